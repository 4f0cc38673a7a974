/* Grounds that the command line names. */
#ifndef MILD_GROUNDS_H
#define MILD_GROUNDS_H

#include "app/cli.h"
#include "env/task/task_def.h"
#include "env/task/terrain.h"
#include "robot/robot.h"
#include "run/config/experiment_keys.h"
#include "run/eval/scene.h"

enum { GROUNDS_MAX = 32 };
/* The names of the grounds of a model, those of mild_merged among mild's, and of all models. They
 * return how many there are. */
int grounds_of(MildModel model, const char *names[GROUNDS_MAX]);
int grounds_all(const char *names[GROUNDS_MAX]);

/* The material of a preset or of a soil's file (soil_find). `rigid` has no material: it sets
 * *rigid, or fails when that is NULL. */
MildStatus grounds_find(const char *name, MildMaterial *material, int *rigid, MildError *error);

/* The model of --model NAME (NULL: not given) or --ground.model=NAME; TASK_MODEL_OWN when neither
 * is given. */
MildStatus grounds_model(const char *option, const CliArgs *args, int *model, MildError *error);

/* Its name, "own" for TASK_MODEL_OWN. */
const char *grounds_model_name(int model);

/* What a command needs to turn names of grounds into materials. */
typedef struct {
    int model;            /* MildModel, or TASK_MODEL_OWN: each ground keeps its law */
    const MildSole *sole; /* raster on which models are matched */
    double load;          /* [N] on that sole */
    const CliArgs *args; /* --ground.KEY=VALUE, applied to the matched material; --task.KEY=VALUE */
    TaskDef *task;       /* NULL: the command takes no --task */
    TerrainDef *terrain; /* NULL: the command takes no --terrain */
    TrainDef *train;     /* of --train.device and --train.robots; NULL: the command takes neither */
} GroundsDef;

/* The GroundsDef for a robot: models are matched under half its weight, and overrides come from
 * `args`. Gives the robot the soles of the model. */
GroundsDef grounds_for_robot(int model, Robot *robot, TaskDef *task, TerrainDef *terrain,
                             const CliArgs *args);
/* Turns a preset into the material of the model, then applies the overrides. */
MildStatus grounds_finish(const GroundsDef *def, MildMaterial *material, MildError *error);
/* The same for every ground of a scene; --ground.KEY leaves `rigid` in a course alone. The model
 * rigid selects the engine's own contact. */
MildStatus grounds_finish_scene(const GroundsDef *def, Scene *scene, MildError *error);
/* Puts the map of --terrain.KEY=VALUE under a finished scene and the task. The caller destroys
 * *map (NULL: level ground) after both. With a pattern of materials the scene's grounds are the
 * pattern's labels, in order, and not a course. */
MildStatus grounds_lay_map(const GroundsDef *def, Scene *scene, MildMap **map, MildError *error);

/* Help on --model; returns `text`. */
const char *grounds_model_help(char *text, size_t size);
/* "rubber foam60 ... sand_dense", for help texts; returns `text`. */
const char *grounds_names(char *text, size_t size);

#endif
