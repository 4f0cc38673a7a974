/* One environment, top to bottom: command, act, observe, reward, randomise, terminate (docs/task.md
 * sections 4 to 11). A TaskEnv is one pointer-free block (its ground memory follows it), so that
 * copying, hashing and saving are one line. Every random number is a function of (seed,
 * environment, tick), so a run depends on no thread count. */
#ifndef MILD_TASK_H
#define MILD_TASK_H

#include <stdint.h>

#include "base/random.h"
#include "env/task/task_def.h"
#include "mild/error.h"

#define TASK_FRAMES 6 /* H + 1, newest last (paper, H = 5) */

/* [-] Friction of rigid ground that a caller has chosen (task_env_reset_on). */
#define TASK_RIGID_FRICTION 0.8

/* Numbers per environment; they follow from the robot's joints and feet. */
typedef struct {
    int joints;
    int feet;
    int observation; /* one frame: angular velocity 3, command 3, gravity 3, joints' angles, speeds
                        and last actions, clock 2 (observe.c) */
    int history;     /* TASK_FRAMES frames */
    int actions;     /* one per joint */
    int estimates;   /* base velocity 3, feet velocities 3 each, feet heights */
    int critic;      /* frame, estimates, 6 of each foot, 34 of the episode (observe.c) */
} TaskShape;
enum { /* of a robot with ROBOT_JOINTS_MAX joints and ROBOT_FEET_MAX feet */
       TASK_OBSERVATION_MAX = 9 + 3 * ROBOT_JOINTS_MAX + 2,
       TASK_HISTORY_MAX = TASK_FRAMES * TASK_OBSERVATION_MAX,
       TASK_ESTIMATES_MAX = 3 + 4 * ROBOT_FEET_MAX,
       TASK_CRITIC_MAX = TASK_OBSERVATION_MAX + TASK_ESTIMATES_MAX + 6 * ROBOT_FEET_MAX + 34
};
TaskShape task_shape(const Robot *robot);
/* First of the ground's numbers in the critic's input: TASK_GROUND_NUMBERS, then whether it is
 * rigid, where the numbers are 0. */
int task_critic_ground(const TaskShape *shape);

/* Gains of the joints. */
typedef struct {
    double kp[ROBOT_JOINTS_MAX]; /* [N m/rad] task.kp or the robot's */
    double kd[ROBOT_JOINTS_MAX]; /* [N m s/rad] task.kd or the robot's */
} TaskGains;

/* As an environment has them: on the CPU its own, on a device one for all. */
#ifdef TASK_ON_DEVICE
typedef const TaskGains *TaskOwnGains;
#else
typedef TaskGains TaskOwnGains;
#endif

typedef struct {
    TaskShape shape;
    uint64_t seed;
    uint32_t index;      /* number of the environment, which selects its stream of random numbers */
    uint32_t tick;       /* policy steps since creation, never reset */
    uint32_t tick_first; /* at creation or when the run went on: then episodes are staggered */
    /* episode */
    uint32_t step;            /* policy steps on the clock of this episode */
    uint32_t step_limit;      /* step at which the episode times out */
    uint32_t step_first;      /* step at which the episode began */
    double phase;             /* [-] gait clock in [0, 1) */
    TaskReal command[3];      /* [m/s, m/s, rad/s] vx, vy, wz in the heading frame */
    TaskReal command_seen[3]; /* what the policy sees, one policy step late */
    int command_frozen;       /* bool: eval and play set the command themselves */
    /* what was drawn for this episode */
    RobotVariation variation;
    int ground[MILD_MATERIALS_MAX]; /* of TaskDef.grounds, by label; unused without them */
    TaskTerrain terrain; /* its map is that of TaskDef during a call and NULL between calls, so
                            that the block contains no pointer */
    TaskReal kp_scale[TASK_JOINTS];      /* [-] */
    TaskReal kd_scale[TASK_JOINTS];      /* [-] */
    TaskReal strength[TASK_JOINTS];      /* [-] of the torque */
    TaskReal motor_offset[TASK_JOINTS];  /* [rad] */
    int lag_command, lag_motor, lag_imu; /* [physics steps] */
    double assist_level;  /* [-] level of assistance: decays while on its feet, rises with falls;
                            persists across episodes */
    TaskReal assist_draw; /* [-] share of the level used in this episode, in [0.5, 1) */
    TaskReal push[6];     /* [m/s, rad/s] last push, for the critic; decays */
    /* state */
    RobotState robot;
    TaskOwnGains gains;
    float action[3][TASK_JOINTS]; /* now, one and two steps ago */
    TaskReal torque[TASK_JOINTS]; /* [N m] of the last physics step */
    uint32_t oldest;              /* place of the oldest frame in the ring, the next to go */
    uint32_t held;                /* frames of the ring */
    TaskReal
        base_twist[6]; /* one policy step ago: linear in the world, angular in the base frame */
    TaskReal smooth_velocity[3];       /* [m/s, m/s, rad/s] vx, vy, wz, heading frame, smoothed over
                                         reward.tracking_time */
    TaskReal joint_speed[TASK_JOINTS]; /* one policy step ago */
    TaskReal air_time[TASK_FEET];
    /* sums over the running episode, for the log */
    TaskReal reward_sum, term_sum[TASK_REWARD_COUNT], speed_error_sum;
} TaskEnv;

/* What lasts beyond an episode. */
typedef struct {
    double assist_level;
    uint64_t tick;
} TaskProgress;

/* Result of one policy step. */
typedef struct {
    float reward;
    uint8_t done, timeout,
        valid; /* valid 0: the simulation diverged, and the sample must get no weight */
    /* of the episode that just ended (done) */
    uint32_t length;
    float episode_reward, episode_terms[TASK_REWARD_COUNT], episode_speed_error;
} TaskStep;

/* Where to write the next observation, with the widths of TaskShape. Any pointer may be NULL. */
typedef struct {
    float *history;  /* [history] noisy, newest frame last */
    float *critic;   /* [critic] */
    float *estimate; /* [estimates] true values, the regression targets */
    float *frame;    /* [observation] newest noisy frame: the decoder's target */
} TaskView;

/* A controller that commands torques. It is called at the start of every physics step and writes
 * [robot_joints] torques, which take the place of the joints' PD, without its latency. The limits
 * of the motors apply to them. The terrain's map is set during the call. */
typedef struct {
    void (*torque)(void *context, const TaskEnv *env, RobotSim *sim, double *torque);
    void *context;
} TaskDrive;

/* Observer for measures and pictures. It is called at the end of every physics step. The terrain's
 * map is set during the call. */
typedef struct {
    void (*physics_step)(void *context, const TaskEnv *env, const RobotSim *sim,
                         const double *torque);
    void *context;
    const TaskDrive *drive; /* NULL: the joints' PD on the actions */
} TaskProbe;

/* One block: TaskEnv, its frames, its ground memory, the state of TaskDef.motors; a multiple of
 * 64. */
size_t task_env_bytes(const TaskDef *def, const Robot *robot);
/* Frames of the ring: as many as the means of the history reach back. */
TASK_FN uint32_t task_frames_held(const TaskDef *def);
/* Of the block without ground memory. */
TASK_FN size_t task_env_head_bytes(const TaskShape *shape, uint32_t held);
MildGround *task_env_ground(TaskEnv *env);
void *task_env_motors(TaskEnv *env); /* state of TaskDef.motors */
/* [shape.history] What the policy sees: five means of older frames, then the newest frame. */
TASK_FN float *task_env_history(TaskEnv *env);
/* [held][shape.observation] The ring of the last frames. */
TASK_FN TaskFrame *task_env_frames(TaskEnv *env);

/* The same for a block without ground memory. gains: of task_gains, 0 beyond the robot's joints; on
 * a device they stay where they are. */
TASK_FN void task_env_init_head(TaskEnv *env, const TaskDef *def, TaskShape shape,
                                const TaskGains *gains, uint64_t seed, uint32_t index);
void task_env_init(TaskEnv *env, const TaskDef *def, const Robot *robot, uint64_t seed,
                   uint32_t index);
/* Draws a new episode and writes its first observation. */
void task_env_reset(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                    const TaskView *view);
/* The same, but the caller has chosen the terrain, except for its map, and whether to use the
 * engine's rigid ground, with the friction TASK_RIGID_FRICTION. The map is that of the TaskDef. */
void task_env_reset_on(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const MildTerrain *terrain, int rigid, const TaskView *view);
/* One policy step. When the episode ends, with auto_reset a new one is drawn and its first
 * observation is written. */
TaskStep task_env_step(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const float *action, int auto_reset, const TaskView *view,
                       const TaskProbe *probe);

/* ---- parts of the step, each in its own file ---- */

/* Readings of one instant (observe.c). */
typedef struct {
    TaskReal omega[3], gravity[3]; /* base frame */
    TaskReal q[TASK_JOINTS], qd[TASK_JOINTS];
} TaskReading;
TASK_FN void task_read_imu(const RobotSim *sim, TaskReading *reading);
TASK_FN void task_read_motors(const RobotSim *sim, TaskReading *reading);
/* Appends the frame made from the readings to the history and writes the view. */
TASK_FN void task_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                          const TaskReading *reading, int first, const TaskView *view);

/* Everything that reward terms may use, computed once per policy step by
 * task_describe_motion (step.c). */
typedef struct {
    const TaskDef *def;
    const Robot *robot;
    const TaskEnv *env;
    TaskReal velocity[3];     /* [m/s] of the base, heading frame */
    TaskReal omega[3];        /* [rad/s] of the base, base frame */
    TaskReal gravity[3];      /* [-] unit vector along gravity, base frame */
    TaskReal twist_change;    /* norm of the change of the base twist in this step, or of its linear
                              part (acceleration_form) */
    TaskReal q[TASK_JOINTS];  /* [rad] */
    TaskReal qd[TASK_JOINTS]; /* [rad/s] */
    TaskReal qd_before[TASK_JOINTS];   /* [rad/s] one policy step ago */
    TaskReal torque[TASK_JOINTS];      /* [N m] */
    TaskReal base_height;              /* [m] above the stance soles */
    TaskReal foot_height[TASK_FEET];   /* [m] lowest sole point above the undisturbed surface */
    TaskReal foot_force[TASK_FEET];    /* [N] of the ground on the foot */
    TaskReal foot_speed[TASK_FEET];    /* [m/s] horizontal, of the sole */
    TaskReal landed_air_time;          /* [s] summed over the feet that touched down */
    int contact[TASK_FEET];            /* bool: the ground carries the foot */
    int stance[TASK_FEET];             /* bool: the clock wants the foot in stance */
    int either[TASK_FEET];             /* bool: stance and swing are both right */
    TaskReal wanted_height[TASK_FEET]; /* [m] h_des of the clock */
    TaskReal foot_distance;            /* [m] see robot_sim_foot_distance */
    TaskReal knee_distance;            /* [m] see robot_sim_knee_distance */
    int standing;                      /* bool: the command is to stand */
} TaskMotion;
/* Describes the policy step just made. The sim is at the end of the step. env still has the base
 * twist, joint speeds, smoothed velocity and air times of the previous step, which are updated.
 * torque: [robot_joints] of the last physics step. */
TASK_FN TaskMotion task_describe_motion(TaskEnv *env, const TaskDef *def, const Robot *robot,
                                        const RobotSim *sim, const TaskReal *torque);
/* Writes the weighted terms per second to `terms`. Returns their clipped sum times the period. */
TASK_FN TaskReal task_reward(const TaskMotion *motion, TaskReal terms[TASK_REWARD_COUNT]);

/* What an environment keeps, and back, before a new episode (step.c). */
TASK_FN TaskProgress task_progress(const TaskEnv *env);
TASK_FN void task_set_progress(TaskEnv *env, TaskProgress kept);

/* Draws ground, robot and sensors of an episode (randomize.c). */
TASK_FN void task_randomize(TaskEnv *env, const TaskDef *def, const Robot *robot);
TASK_FN void task_draw_command(TaskEnv *env, const TaskDef *def);
/* Draws the ground of an episode: one material, or stripes of three (ground.c,
 * env/batch_step.inc). */
TASK_FN void task_draw_ground(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r);
/* Draws where on the map it begins, and a material for each of its labels. */
TASK_FN void task_draw_on_map(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r);
/* The numbers of the material under the base that the critic sees, each scaled to about one;
 * [TASK_GROUND_NUMBERS], in the buffer or elsewhere. */
enum { TASK_GROUND_NUMBERS = 12 };
TASK_FN const float *task_ground_under(const TaskEnv *env, const TaskDef *def, const Robot *robot,
                                       const RobotSim *sim, float *buffer);
/* The same of any material. */
void task_ground_numbers(const Robot *robot, const MildMaterial *material, float *numbers);
/* [m] Depth of the soles of a robot that stands on a material. */
double task_standing_depth(const Robot *robot, const MildMaterial *material);

/* A motor during a policy step. */
typedef struct {
    TaskReal target[2]; /* [rad] of the action now and of the one before */
    TaskReal kp;        /* [N m/rad] */
    TaskReal kd;        /* [N m s/rad] */
    TaskReal limit;     /* [N m] */
    TaskReal fastest;   /* [rad/s] 0: no limit */
} TaskMotor;

/* A policy step (step.c): what comes before its physics steps, the motor of joint i, its torque at
 * angle q and speed qd, and what comes after them. late: bool, the last action still counts.
 * task_motors_act is true when physics step k of `steps` computes torques anew; otherwise those of
 * the step before go on, which env->torque has kept.
 * torque: [joints] of the last physics step. diverged: bool, they broke off. */
TASK_FN void task_begin_step(TaskEnv *env, const TaskDef *def, const float *action);
TASK_FN TaskMotor task_motor(const TaskEnv *env, const TaskDef *def, const Robot *robot, int i);
TASK_FN double task_torque(const TaskMotor *motor, int late, double q, double qd);
TASK_FN int task_motors_act(const TaskEnv *env, const TaskDef *def, int k, int steps);
TASK_FN TaskStep task_end_step(TaskEnv *env, const TaskDef *def, const Robot *robot,
                               const RobotSim *sim, const TaskReal *torque, int diverged);
/* One policy step on the clocks of the episode: the phase, the command that the policy sees and, if
 * the caller does not set it, a new command (step.c). */
TASK_FN void task_advance_clock(TaskEnv *env, const TaskDef *def);
/* An episode on what task_randomize drew (step.c). depth: [m] how deep the feet stand in its
 * ground. The first reading is taken from the sim of its first pose. */
TASK_FN void task_begin_episode(TaskEnv *env, const TaskDef *def, const Robot *robot, double depth);
TASK_FN void task_first_reading(TaskEnv *env, const RobotSim *sim, TaskReading *reading);

/* Assistance early in training (assist.c). task_assist writes force and torque on the base, world,
 * and returns 0 when there is none. rotation: [9] of the base; qvel: [6] its twist.
 * task_assist_pose is the angle that the action of joint i is added to: that of the default pose,
 * moved along the reference gait while there is assistance. */
TASK_FN double task_assist_share(const TaskEnv *env, const TaskDef *def);
TASK_FN void task_assist_adapt(TaskEnv *env, int fallen);
TASK_FN int task_assist(const TaskEnv *env, const TaskDef *def, const Robot *robot,
                        const TaskReal *rotation, const TaskReal *qvel, TaskReal wrench[6]);
TASK_FN double task_assist_pose(const TaskEnv *env, const TaskDef *def, const Robot *robot, int i);

/* Gait clock (gait.c): a foot is in stance during the half of the period that starts at its
 * offset. */
TASK_FN int task_is_standing(const TaskDef *def, const TaskReal command[3]);
/* [s] Period of the clock under a command. */
TASK_FN double task_gait_period(const TaskDef *def, const TaskReal command[3]);
TASK_FN int task_gait_stance(const Robot *robot, double phase, int standing, int foot);
TASK_FN double task_gait_height(const TaskDef *def, const Robot *robot, double phase, int standing,
                                int foot);
/* Bool: near touchdown and lift-off, where stance and swing are both right. */
TASK_FN int task_gait_either(const TaskDef *def, const Robot *robot, double phase, int standing,
                             int foot);
/* [rad] Angle of joint i in the reference motion. */
TASK_FN double task_gait_reference(const TaskDef *def, const Robot *robot, double phase,
                                   int standing, int i);

/* Mirror symmetry left <-> right: o'_i = sign_i o_index_i, and actions alike. */
typedef struct {
    int observation_index[TASK_OBSERVATION_MAX];
    float observation_sign[TASK_OBSERVATION_MAX];
    int action_index[ROBOT_JOINTS_MAX];
    float action_sign[ROBOT_JOINTS_MAX];
} TaskMirror;
TaskMirror task_mirror(const Robot *robot);

#endif
