/* Trials and measures (docs/task.md section 12): one definition, used everywhere. */
#ifndef MILD_EVAL_H
#define MILD_EVAL_H

#define EVAL_GRAVITY 9.81 /* [m/s^2] of a robot's weight */

#include <stdio.h>

#include "base/pool.h"
#include "control/controller.h"
#include "run/eval/measure.h"
#include "run/eval/scene.h"

/* A decision of the controller: the environment's true state, the newest frame of its history, and
 * the action that came out. */
typedef struct {
    const TaskDef *task;
    const Scene *scene;
    double speed; /* [m/s] commanded */
    int trial;
    double time; /* [s] */
    TaskEnv *env;
    const float *action; /* [robot_actions] */
} EvalDecision;

/* Called after each decision for a trial that is not over, trial by trial. */
typedef struct {
    void (*decided)(void *context, const EvalDecision *decision);
    void *context;
} EvalCallback;

typedef struct {
    double speed;    /* [m/s] commanded, forward */
    double sideways; /* [m/s] commanded, to the left */
    double turn;     /* [rad/s] commanded; 0: the heading is held */
    double jump;     /* [m] commanded rise of jumps, after a second of standing; 0: none */
    double push;     /* [m/s] added to the base in a random direction, every 4 s; by MuJoCo */
    int trials;
    double seconds; /* [s] per trial */
    double stop;    /* [s] when the command becomes 0 and speed measurement ends; 0: never */
    uint64_t seed;  /* trial k uses stream k */
    int start;      /* a TaskStart: that of EvalRun.task */
    FILE *stances;  /* a row of CSV for each stance of each trial; NULL: none */
    int led;        /* bool: how fast to go is heard on standard input, see hear_speed; by MuJoCo */
    /* by MuJoCo, of one row; NULL: none */
    const EvalCallback *callback;
    FILE *actions; /* a row of CSV for each decision, see eval/actions.h */
    FILE *track;   /* one for each policy step of each trial, see eval/track.h */
    FILE *feet;    /* one for each foot in each physics step, see eval/track.h */
} EvalDef;

/* Means over the trials, SI units. NaN: nothing was measured, as the speed of trials that fell at
 * once, the sinkage without a stance, or a deviation of one trial. */
typedef struct {
    char ground[SCENE_NAME_SIZE];
    double speed;             /* [m/s] commanded, forward */
    int trials;               /* number of trials */
    int success;              /* trials without termination */
    int ends[TASK_END_COUNT]; /* trials that ended by each cause */
    int start;                /* a TaskStart */
    int righted;              /* trials that were up when their time ended: measure_up */
    double up;                /* [s] when these came up */
    int measured;             /* trials that velocity and cot are means of; 0: all were too short */
    double velocity;      /* [m/s] forward, after the first 2 s, of trials that lasted longer: along
                        world x, or along the robot's heading when the command is to turn */
    double velocity_low;  /* [m/s] 95 % interval of the mean over trials: lower end */
    double velocity_high; /* [m/s] upper end */
    double sideways;      /* [m/s] commanded, to the left */
    double velocity_sideways;  /* [m/s] measured, to the left */
    double turn;               /* [rad/s] commanded */
    double velocity_turn;      /* [rad/s] measured */
    double push;               /* [m/s] */
    double jump;               /* [m] commanded rise */
    double cot;                /* [-] sum |tau qd| / (m g v); NaN when the command is to stand */
    double torque_max;         /* [N m] largest over joints and time, mean over trials */
    double velocity_deviation; /* [m/s] standard deviation over the trials of velocity */
    double cot_deviation;      /* [-] of cot */
    double torque_deviation;   /* [N m] of torque_max */
    double clearance;          /* [m] swing apex of the lowest sole point above h0 */
    double penetration;        /* [m] deepest element of each stance */
    double drift;            /* [m] horizontal travel of the sole between touchdown and lift-off */
    double drift_forward;    /* [m] magnitude of its part along the robot's heading */
    double drift_left;       /* [m] and across it */
    double drift_path;       /* [m] length of the way of the sole in a stance, not its straight
                                distance */
    double stride;           /* [m] from a foot's touchdown to its next one, after the first 2 s */
    double cadence;          /* [1/s] of these strides */
    double rise;             /* [m] of the centre of mass in the flights of the steady part, over
                                where it was after MEASURE_SETTLED, mean; by MuJoCo */
    double flight;           /* [-] share of the time after the first 2 s with nothing down */
    double duty;             /* [-] share of it that a foot is down, mean over the feet */
    double load_peak;        /* [weights] largest vertical force on a foot in a stance, mean */
    double load_rate;        /* [weights/s] its largest rise in 10 ms, mean */
    double joint_speed_max;  /* [rad/s] largest after the first 2 s, of all trials */
    double torque_rms;       /* [N m] root mean square of the joint that has the largest */
    double at_limit;         /* [-] share of the time that the joint that is most often at its
                                limit is there */
    double energy;           /* [J] integral |tau . qd| dt */
    double legs;             /* [m] least distance of two legs after 1 s, of all trials */
    Smoothness smooth;       /* after 1 s, of all trials */
    double shells;           /* [-] share of the load that shells carried, mean of the trials */
    double base_oscillation; /* [m] peak to peak of the base height over the steady part */
    double seconds;          /* [s] mean time until a fall or the end */
} EvalRow;

/* How a trial ended. */
typedef struct {
    TaskEnd end;
    double up; /* [s] when it came up, see measure_up; NaN: it was not up when its time ended */
    double seconds; /* [s] until then */
    double legs;    /* [m] least distance of two legs, see measure_legs */
    double shells;  /* [-] share of the load that shells carried */
    double torque;  /* [N m] largest over joints and time */
    double x;       /* [m] world, where the base was then */
} EvalTrial;

/* Rows of trials. */
typedef struct {
    /* Control, gait and sensors. Its randomisation should be nominal (task_def_make_nominal). Its
     * map is that of the scenes. */
    const TaskDef *task;
    const Robot *robot;
    Pool *pool;             /* trials run in parallel */
    Controller *controller; /* by the batch engine one with act_on */
    int batch;              /* bool: the batch engine steps the robots, else MuJoCo */
    int device;             /* a CUDA device, or MILD_BATCH_HOST; MuJoCo's is the latter */
    const Scene *scenes;    /* [scene_count] by the batch engine of one material each */
    int scene_count;
    const double *speeds; /* [m/s] [speed_count] of each scene, in the place of eval.speed */
    int speed_count;
    EvalDef eval;
    /* [eval.trials] by MuJoCo, of one row: who computes the soft ground; NULL: libmild */
    const RobotGround *ground;
    EvalTrial *each; /* [scene_count][speed_count][eval.trials] where to write; NULL: nowhere */
} EvalRun;

/* Robots of the batch engine, at most. */
#define EVAL_ROBOTS_MAX 65536
/* rows: [scene_count][speed_count], all at once. The results depend only on the run and its seed.
 * The two backends give the same measures and draw the same random numbers, but for the latencies.
 * Fails for what the batch engine has not, and for more robots. */
MildStatus eval_run(const EvalRun *run, EvalRow *rows, MildError *error);

/* Finishes the measures of the trials, summarises them in a row, and prints the stances that they
 * kept. measures, ends (TaskEnd): [eval->trials]. weight: [N] of the robot. */
MildStatus eval_summarise(EvalRow *row, const char *ground, const EvalDef *eval, Measure *measures,
                          const uint8_t *ends, double weight, MildError *error);

/* Heading hold of eval and play: sets a command that turns the robot back to world x. speed,
 * sideways [m/s]: forward and to the left. If both are 0 the robot stands, without heading hold.
 * Writes env->command and freezes it. */
void eval_command(TaskEnv *env, double speed, double sideways);

/* The names of the columns of EvalDef.stances, SI units. */
void eval_print_stances_header(FILE *csv);

/* Text table. */
void eval_print_header(char *text, int size);
void eval_print_row(const EvalRow *row, char *text, int size);

#endif
