/* What a command with a robot that walks opens first: task, robot, ground, and who moves it. */
#ifndef APP_CONTEXT_H
#define APP_CONTEXT_H

#include "app/grounds.h"
#include "app/robots.h"
#include "base/paths.h"
#include "base/pool.h"
#include "control/controller.h"
#include "env/actuator/actuator.h"

typedef struct {
    /* options; NULL: not given */
    const char *policy;     /* context_open writes the default */
    const char *robot_name; /* of --robot */
    const char *config, *model;
    const char *controller; /* NULL: the command has none, and the policy moves the robot */
    /* of the command */
    int on_ground;  /* bool: overrides are read with each ground's, by context_scene; otherwise only
                       those of section [task], by context_open */
    int randomized; /* bool, see experiment_task */
    int machine;    /* bool: --train.device and --train.robots are read with the ground's */
    int without_policy; /* bool: neither the policy's file nor a default for it is read */
    TerrainDef terrain;
    TrainDef train;
    Pool *pool; /* destroyed by context_close; NULL: none */
    /* opened */
    TaskDef task;
    Robot *robot;
    GroundsDef grounds; /* on_ground */
    MildMap *map;       /* of the latest scene; NULL: level */
    Actuator *actuator;
    Controller mover;
    char named[TRAIN_ROBOT_SIZE]; /* robot of config or policy */
    char shipped[PATH_SIZE];
    char model_help[320], controller_help[ROBOTS_CONTROLLER_HELP];
} Context;

Context context_default(void);
/* Task, robot and ground model. Close it, whatever comes out. */
MildStatus context_open(Context *c, const CliArgs *args, MildError *error);
/* A ground, or a course of them with `patch` [m] each, finished with the overrides, and its map
 * under the task. The map lasts until the next scene. */
MildStatus context_scene(Context *c, const char *name, double patch, Scene *scene,
                         MildError *error);
/* The task's actuator and the controller `mover`, for `rows` robots. */
MildStatus context_move(Context *c, int rows, MildError *error);
void context_close(Context *c);

/* Bool: the controller acts by a policy whose file says its task. */
int context_has_policy(const Context *c);

/* Rows of CliCommand.options. */
CliOption context_policy(Context *c, const char *help);
CliOption context_robot(Context *c);
CliOption context_controller(Context *c);
CliOption context_config(Context *c);
CliOption context_model(Context *c);

#endif
