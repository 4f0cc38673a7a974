/* What moves the robots. A controller is one row of CONTROLLER_LIST and one file that implements
 * this interface. Evaluation and play know nothing else about it. Where the lab is built, the rows
 * of lab/lists.h follow. */
#ifndef MILD_CONTROLLER_H
#define MILD_CONTROLLER_H

#include "base/pool.h"
#include "control/speed_hold.h"
#include "env/task/task.h"

typedef struct {
    void *self;
    const char *name;
    /* Writes actions [rows][robot_actions] for the present state of the environments. One caller at
     * a time. */
    void (*act)(void *self, int rows, TaskEnv *const *envs, float *actions);
    void (*destroy)(void *self);
    /* The same from their histories alone, [rows][TaskShape.history]; NULL: it needs more. */
    void (*act_on)(void *self, int rows, const float *history, float *actions);
    /* Writes the torques [robot_joints] of one row's environment at the start of a physics step
     * (TaskDrive), in place of its actions. Called after `act`, for different rows at the same
     * time. NULL: the joints' PD on the actions. */
    void (*torque)(void *self, int row, const TaskEnv *env, RobotSim *sim, double *torque);
    /* [TaskShape.estimates] Its estimate of EnvsView.estimate in a row's last action; or NULL. */
    const float *(*estimates)(void *self, int row);
} Controller;

/* One row of a controller that commands torques. */
typedef struct {
    const Controller *controller;
    int row;
} ControllerRow;
TaskDrive controller_drive(ControllerRow *row);

/* Properties of a controller, as bits. */
enum {
    CONTROLLER_FOLLOWS = 1,   /* walks as the command says; the others stand */
    CONTROLLER_OWN_GAINS = 2, /* gains or torques of its own: task.actuator would have no effect */
    CONTROLLER_POLICY = 4     /* the file of --policy says its task, too */
};

/* Name, properties and summary; the file defines controller_make_NAME. */
#define CONTROLLER_LIST(X)                                                                         \
    X(learned, CONTROLLER_FOLLOWS | CONTROLLER_POLICY, "the policy of --policy")                   \
    X(stand, CONTROLLER_OWN_GAINS,                                                                 \
      "stands still and balances, ignores the command; gains stand_kp, stand_kd of robot.ini")     \
    X(zero, 0, "takes no action, so the joints hold the default pose")

/* What a controller may need. It is borrowed and must outlive the controller. */
typedef struct {
    const char *policy; /* file, for `learned`, `clock`, `ht2` */
    const TaskDef *task;
    const Robot *robot;
    Pool *pool;   /* may be NULL */
    int rows_max; /* most environments in one call */
} ControllerDef;

#define CONTROLLER_MAKE(name, properties, summary)                                                 \
    MildStatus controller_make_##name(const ControllerDef *def, Controller *controller,            \
                                      MildError *error);
CONTROLLER_LIST(CONTROLLER_MAKE)

int controller_count(void);
const char *controller_name(int index); /* index < controller_count() */
const char *controller_summary(int index);
/* Bool: the row of this name has the property; no for an unknown name. */
int controller_has(const char *name, int property);
/* Fails when there is no controller of this name. The message contains the nearest name. */
MildStatus controller_check(const char *name, MildError *error);
/* The caller must destroy *controller. */
MildStatus controller_make(const char *name, const ControllerDef *def, Controller *controller,
                           MildError *error);

/* The paper's controller: a trained policy file, deterministic (z = mu, mean action), for frames of
 * the default task. pool may be NULL. Fails when the file holds a policy of another robot or of
 * another shape. */
MildStatus controller_learned(const char *path, const Robot *robot, Pool *pool, int rows_max,
                              Controller *controller, MildError *error);
/* [estimates] of a row's last action, or NULL. */
const float *controller_estimates(const Controller *controller, int row);
/* Off for a controller that estimates nothing. */
SpeedHoldDef speed_hold_def(const TaskDef *task, const Robot *robot, const Controller *controller);
void controller_destroy(Controller *controller);

#endif
