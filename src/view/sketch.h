/* A robot on its ground from its right side, in dots of Braille characters: the picture of a
 * terminal, which needs no OpenGL. */
#ifndef VIEW_SKETCH_H
#define VIEW_SKETCH_H

#include "robot/robot.h"

typedef struct {
    int columns, rows;   /* characters; each has 2 x 4 dots */
    double dots;         /* [1/m] */
    double depth;        /* [m] of ground below the robot */
    int rigid;           /* bool: the ground never yields */
    double x_min, x_max; /* [m] where it keeps imprints */
} SketchDef;
SketchDef sketch_def_default(void);

typedef struct Sketch Sketch;
/* The robot is borrowed; of the terrain its map. */
Sketch *sketch_create(const SketchDef *def, const Robot *robot, const MildTerrain *terrain,
                      MildError *error);
void sketch_destroy(Sketch *sketch);
int sketch_rows(const Sketch *sketch);
/* Presses the feet into the ground that is drawn. Once per policy step. */
void sketch_observe(Sketch *sketch, const RobotSim *sim);
/* The picture: `rows` lines of UTF-8, each with its line end. Valid until the next call. */
const char *sketch_draw(Sketch *sketch, const RobotSim *sim);

#endif
