/* Grounds by name, as the command line says them. */
#ifndef MILD_GROUNDS_H
#define MILD_GROUNDS_H

#include "app/cli.h"
#include "config/experiment_keys.h"
#include "eval/scene.h"
#include "robot/robot.h"
#include "task/task_def.h"
#include "task/terrain.h"

/* The preset's material; an unknown name fails with the nearest known one. `rigid` is no material:
 * it fails unless *rigid is given, which it sets. */
MildStatus grounds_find(const char *name, MildMaterial *material, int *rigid, MildError *error);

/* The model that --model NAME (NULL: not given) or --ground.model=NAME asks for; mild without
 * either. */
MildStatus grounds_model(const char *option, const CliArgs *args, MildModel *model,
                         MildError *error);

/* What a command does to the grounds it was told by name. */
typedef struct {
    MildModel model;
    const MildSole *sole; /* the raster a rival of mild is matched on */
    double load;          /* [N] under it */
    const CliArgs
        *args;     /* --ground.KEY=VALUE, laid over the matched material; and --task.KEY=VALUE */
    TaskDef *task; /* NULL: the command takes no --task */
    TerrainDef *terrain; /* NULL: no --terrain either */
} GroundsDef;

/* For the robot: matched under half its weight, overrides from `args`, and the robot gets the soles
 * of the model. */
GroundsDef grounds_for_robot(MildModel model, Robot *robot, TaskDef *task, TerrainDef *terrain,
                             const CliArgs *args);
/* A preset becomes the material of the model, with the overrides laid over it. */
MildStatus grounds_finish(const GroundsDef *def, MildMaterial *material, MildError *error);
/* The same for every ground of a scene; the model rigid puts it on the engine's own contact. */
MildStatus grounds_finish_scene(const GroundsDef *def, Scene *scene, MildError *error);
/* The map that --terrain.KEY=VALUE asks for, under a finished scene and the task: *map (NULL:
 * level) is the caller's to destroy after both. With a pattern the scene's grounds are its labels,
 * in order, instead of a course. */
MildStatus grounds_lay_map(const GroundsDef *def, Scene *scene, MildMap **map, MildError *error);

/* Help on --model; returns `text`. */
const char *grounds_model_help(char *text, size_t size);
/* "rubber foam60 ... sand_dense", for help texts; returns `text`. */
const char *grounds_names(char *text, size_t size);

#endif
