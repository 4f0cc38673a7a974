/* Measures of one trial, updated at every physics step. */
#ifndef MILD_MEASURE_H
#define MILD_MEASURE_H

#include "env/envs.h"
#include "env/task/state.h"
#include "env/trial.h"

/* How smoothly a robot moves: what is asked of its joints, and what base and joints do, after each
 * policy step. */

#define SMOOTH_JERK_STEPS 2   /* policy steps: 20 ms, in which nanoG1 decides once */
#define SMOOTH_JERK_UNIT 0.25 /* [rad] per unit action of nanoG1 */

/* Sums over the policy steps that begin at `from` or later. */
typedef struct {
    int steps;    /* so far, counted or not */
    int counted;  /* of them */
    int targets;  /* of these, those in which targets were commanded, not torques */
    double tilt;  /* [rad^2/s^2] squares of roll and pitch rate */
    double yaw;   /* [rad^2/s^2] squares of the yaw rate */
    double joint; /* [rad^2/s^2] squares of the joint speeds, mean over the joints */
    double jerk;  /* [rad^2] squares of the targets' changes in 20 ms, mean over the joints */
    double jump;  /* [rad] largest change of a target in a policy step */
    double target[SMOOTH_JERK_STEPS][ROBOT_JOINTS_MAX]; /* [rad] latest first */
} Smooth;

/* Of trials; NaN: nothing was counted. */
typedef struct {
    double
        target_jump; /* [rad] largest change of a joint's target from a policy step to the next */
    double action_jerk; /* [0.25 rad] root mean square over joints of its change in 20 ms */
    double tilt_rate;   /* [rad/s] of roll and pitch rate: the root of the mean of the sum of both
                           squares */
    double yaw_rate;    /* [rad/s] root mean square, about the base's own axis */
    double joint_speed; /* [rad/s] root mean square over joints */
} Smoothness;

/* A policy step of `period` [s]. after: its last physics step. joints: the first of the robot's,
 * which are not driven. action: [joints] clipped to +-clip, it moves
 * a target by `scale` [rad]; NULL: torques were commanded. */
void smooth_take(Smooth *smooth, double from, double period, const EnvsSample *after, int joints,
                 const float *action, double scale, double clip);
/* Adds a trial's sums to those of others. */
void smooth_add(Smooth *sum, const Smooth *trial);
Smoothness smooth_result(const Smooth *sum);

#define MEASURE_STEADY 2.0    /* [s] start of the steady part */
#define MEASURE_SETTLED 1.0   /* [s] from here on legs and smoothness count: the start is random */
#define MEASURE_FLIGHT 0.05   /* [s] shorter flights are no jumps */
#define MEASURE_UP_TILT 0.3   /* [rad] a robot that is up tilts less */
#define MEASURE_UP_HEIGHT 0.7 /* [-] and its base is higher over its soles, of the nominal height */
#define MEASURE_UP_TIME 2.0   /* [s] so long */
#define MEASURE_RISE 0.01     /* [s] in which the load on a foot rises, for its rate */
#define MEASURE_RISE_STEPS 20 /* physics steps of it, at most */

/* A finished stance. */
typedef struct {
    int foot;
    double start, duration; /* [s] first contact; until the last one */
    double depth;           /* [m] deepest element */
    double way[2]; /* [m] of the sole's centre, along the robot's heading and to the left */
    double apex;   /* [m] of the swing before it; 0: none */
    double at[2];  /* [m] the sole's centre at the first contact, world */
    double torque; /* [N m] largest of any joint while the foot stood */
} MeasureStance;

/* A stance begins when the ground carries the foot and ends with the last contact before a pause of
 * CHATTER_TIME. */
typedef struct {
    double dt;              /* [s] physics step */
    double time;            /* [s] since the start */
    double energy;          /* [J] integral |sum tau qd| dt */
    double torque_max;      /* [N m] */
    double torque;          /* [N m] largest of the latest step */
    double base[2];         /* [m] after the latest step */
    double yaw;             /* [rad] after the latest step */
    double settled;         /* [m] height of the centre of mass at MEASURE_SETTLED */
    double legs;            /* [m] least distance of two legs from MEASURE_SETTLED on */
    Smooth smooth;          /* from then on, too; set by smooth_take */
    double load;            /* [N s] of the feet and of the shells */
    double shell_load;      /* [N s] of the shells */
    double nominal_height;  /* [m] of the base above the soles; set by the caller for measure_up */
    const TaskMotor *motor; /* [joints] limits of the motors; set by the caller; NULL: none */
    double up_since;        /* [s] start of the running time in which it is up; NaN: it is not */

    /* steady part */
    double steady_end;          /* [s] where it ends; 0: with the trial */
    double steady_time;         /* [s] */
    double start[2];            /* [m] base at the start of the steady part */
    double end[2];              /* [m] base at its end */
    double way[2];              /* [m] sum of the base's steps, forward and to the left */
    double turned;              /* [rad] */
    double work;                /* [J] integral sum |tau qd| dt */
    double base_low, base_high; /* [m] */
    double flight;              /* [s] without a foot or a shell on the ground */
    double flying;              /* [s] since it left the ground; 0: it is down */
    double flight_apex;         /* [m] highest of the centre of mass since then, world */
    int flights;                /* finished ones of MEASURE_FLIGHT at least */
    double flight_rise;         /* [m] sum of their apexes over `settled` */
    double stance;              /* [s] that a foot is on the ground, mean over the feet */
    double joint_speed;         /* [rad/s] largest */
    double torque_square[ROBOT_JOINTS_MAX]; /* [N^2 m^2 s] */
    double limited[ROBOT_JOINTS_MAX];       /* [s] with the torque at its limit */

    /* the running stance or swing of each foot */
    int in_stance[ROBOT_FEET_MAX];       /* bool */
    double touchdown[ROBOT_FEET_MAX][2]; /* [m] sole centre at the first contact */
    double last[ROBOT_FEET_MAX][2];      /* [m] sole centre at the latest contact */
    double air_time[ROBOT_FEET_MAX];     /* [s] since the latest contact */
    double apex[ROBOT_FEET_MAX];         /* [m] highest of the foot since then */
    double deepest[ROBOT_FEET_MAX];      /* [m] */
    double began[ROBOT_FEET_MAX];        /* [s] */
    double lasted[ROBOT_FEET_MAX];       /* [s] */
    double swing[ROBOT_FEET_MAX];        /* [m] apex of the swing before */
    double path[ROBOT_FEET_MAX];         /* [m] of the sole centre since the first contact */
    double hardest[ROBOT_FEET_MAX];      /* [N m] largest torque since then */
    double peak[ROBOT_FEET_MAX];         /* [N] largest load since then */
    double rise[ROBOT_FEET_MAX];         /* [N] in MEASURE_RISE, largest */
    double recent[ROBOT_FEET_MAX][MEASURE_RISE_STEPS]; /* [N] ring of the latest loads */
    int samples;                                       /* physics steps */
    double speed[ROBOT_JOINTS_MAX]; /* [rad/s] at which the motors computed the latest torque */
    int landed[ROBOT_FEET_MAX];     /* bool: began and touchdown are of the steady part */

    /* finished ones */
    int swings, stances, strides; /* a stride: from a foot's touchdown to its next one */
    double apex_sum, deepest_sum, drift_sum, path_sum; /* [m] */
    double peak_sum, rise_sum;                         /* [N] */
    double stride_sum, stride_time;                    /* [m] [s] of the strides */
    double way_sum[2];   /* [m] of the magnitudes of MeasureStance.way */
    int keep;            /* bool: each of them is kept; the owner frees `kept` */
    MeasureStance *kept; /* [stances]; NULL if memory ran out */
    int room;            /* of kept */
} Measure;

/* [rad] Heading of a base with this orientation (w x y z). */
double measure_yaw(const double quaternion[4]);
void measure_start(Measure *measure, double dt);
/* One physics step. */
void measure_sample(Measure *measure, const EnvsSample *sample);
/* The same of a robot of MuJoCo, from a TaskCallback. */
void measure_step(Measure *measure, const TaskEnv *env, const RobotSim *sim, const double *torque);
/* Ends the trial. If no foot was ever lifted, the open stances count, so that sinkage and drift are
 * still measured. */
void measure_finish(Measure *measure);
/* [s] When it came up: tilt and height over the soles (MEASURE_UP_...) have been those of a robot
 * that stands from then to the latest step, for MEASURE_UP_TIME at least; NaN: it is not up. */
double measure_up(const Measure *measure);
/* [-] Share of the load that the shells carried; 0 without load. */
double measure_shells(const Measure *measure);
/* [m] Least distance of two legs from MEASURE_SETTLED on, negative: overlap; NaN where the robot
 * has no two legs that touch, or where the trial was over by then. */
double measure_legs(const Measure *measure);
void measure_free(Measure *measures, int count); /* measures: from calloc; may be NULL */

#endif
