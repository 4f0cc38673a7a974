/* A ground to walk on, by name: a preset, the file of a soil (ground/soil/soil.h), `rigid`, or a
 * course of them crossed in order ("rubber+./mars.ini+rigid"). In a course `rigid` is a very hard
 * material. */
#ifndef MILD_SCENE_H
#define MILD_SCENE_H

#include "mild/ground.h"

enum { SCENE_NAME_SIZE = 512 };

typedef struct {
    char name[SCENE_NAME_SIZE];
    MildTerrain terrain;
    int rigid; /* bool: the engine's own contact */
} Scene;

/* patch_length: [m] length of each ground of a course; negative: they follow each other backward
 * from the start. The first ground also extends to the other side of the start, and the last has no
 * end. */
MildStatus scene_make(Scene *scene, const char *name, double patch_length, MildError *error);
/* Bool: ground number `index` of a course is `rigid`, whose numbers are its own. */
int scene_is_hard(const Scene *scene, int index);
/* Name of the ground under x. */
const char *scene_ground_at(const Scene *scene, double x, double y, char *text, int size);

#endif
