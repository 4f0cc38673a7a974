/* One environment, top to bottom: command, act, observe, reward, randomise, terminate (docs/task.md
 * sections 4 to 11). A TaskEnv is one pointer-free block (its ground memory follows it), so that
 * copying, hashing and saving are one line. Every random number is a function of (seed,
 * environment, tick), so a run depends on no thread count. */
#ifndef MILD_TASK_H
#define MILD_TASK_H

#include <stdint.h>

#include "base/random.h"
#include "mild/error.h"
#include "task/task_def.h"

#define TASK_FRAMES 6 /* H + 1, newest last (paper, H = 5) */

/* [-] Friction of rigid ground that a caller has chosen (task_env_reset_on). */
#define TASK_RIGID_FRICTION 0.8
/* Scale of the feet heights among the estimates, so that centimetres count as much in the
 * regression as velocities in m/s. */
#define TASK_HEIGHT_SCALE 10.0
/* Scale of the base velocity. 0.05 m/s is a tenth of a slow walk, so it must matter to the
 * regression and to the actor. */
#define TASK_VELOCITY_SCALE 4.0

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

typedef struct {
    TaskShape shape;
    uint64_t seed;
    uint32_t index;      /* number of the environment, which selects its stream of random numbers */
    uint32_t tick;       /* policy steps since creation, never reset */
    uint32_t tick_first; /* at creation or when the run went on: then episodes are staggered */
    /* episode */
    uint32_t step;          /* policy steps on the clock of this episode */
    uint32_t step_limit;    /* step at which the episode times out */
    uint32_t step_first;    /* step at which the episode began */
    double phase;           /* [-] gait clock in [0, 1) */
    double command[3];      /* [m/s, m/s, rad/s] vx, vy, wz in the heading frame */
    double command_seen[3]; /* what the policy sees, one policy step late */
    int command_frozen;     /* bool: eval and play set the command themselves */
    /* what was drawn for this episode */
    RobotVariation variation;
    int ground[MILD_MATERIALS_MAX]; /* of TaskDef.grounds, by label; unused without them */
    MildTerrain terrain; /* its map is that of TaskDef during a call and NULL between calls, so
                            that the block contains no pointer */
    double kp_scale[ROBOT_JOINTS_MAX];     /* [-] */
    double kd_scale[ROBOT_JOINTS_MAX];     /* [-] */
    double strength[ROBOT_JOINTS_MAX];     /* [-] of the torque */
    double motor_offset[ROBOT_JOINTS_MAX]; /* [rad] */
    int lag_command, lag_motor, lag_imu;   /* [physics steps] */
    double assist_level; /* [-] level of assistance: decays while on its feet, rises with falls;
                            persists across episodes */
    double assist_draw;  /* [-] share of the level used in this episode, in [0.5, 1) */
    double push[6];      /* [m/s, rad/s] last push, for the critic; decays */
    /* state */
    RobotState robot;
    double kp[ROBOT_JOINTS_MAX];       /* [N m/rad] task.kp or the robot's */
    double kd[ROBOT_JOINTS_MAX];       /* [N m s/rad] task.kd or the robot's */
    float action[3][ROBOT_JOINTS_MAX]; /* now, one and two steps ago */
    uint32_t newest;                   /* frame in the ring, see task_env_frame */
    uint32_t held;                     /* frames of the ring */
    double base_twist[6]; /* one policy step ago: linear in the world, angular in the base frame */
    double smooth_velocity[3]; /* [m/s, m/s, rad/s] vx, vy, wz, heading frame, smoothed over
                                         reward.tracking_time */
    double joint_speed[ROBOT_JOINTS_MAX]; /* one policy step ago */
    double air_time[ROBOT_FEET_MAX];
    /* sums over the running episode, for the log */
    double reward_sum, term_sum[TASK_REWARD_COUNT], speed_error_sum;
} TaskEnv;

/* What lasts beyond an episode. */
typedef struct {
    double assist_level;
    uint64_t tick;
} TaskKept;

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

/* Observer for measures and pictures. It is called at the end of every physics step. The terrain's
 * map is set during the call. */
typedef struct {
    void (*physics_step)(void *context, const TaskEnv *env, const RobotSim *sim,
                         const double *torque);
    void *context;
} TaskProbe;

/* One block: TaskEnv, its frames, its ground memory; a multiple of 64. */
size_t task_env_bytes(const TaskDef *def, const Robot *robot);
/* Of the block without ground memory. */
size_t task_env_head_bytes(const TaskDef *def, const TaskShape *shape);
MildGround *task_env_ground(TaskEnv *env);
/* Where the block's frames begin. */
TASK_FN size_t task_env_frames_at(void);
/* [shape.history] What the policy sees: five means of older frames, then the newest frame. */
TASK_FN float *task_env_history(TaskEnv *env);
/* [shape.observation] The frame of `age` policy steps ago, 0 .. held - 1. */
TASK_FN float *task_env_frame(TaskEnv *env, int age);

/* The same for a block without ground memory. */
void task_env_init_head(TaskEnv *env, const TaskDef *def, const Robot *robot, uint64_t seed,
                        uint32_t index);
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
    double omega[3], gravity[3]; /* base frame */
    double q[ROBOT_JOINTS_MAX], qd[ROBOT_JOINTS_MAX];
} TaskReading;
TASK_FN void task_read_imu(const RobotSim *sim, TaskReading *reading);
TASK_FN void task_read_motors(const RobotSim *sim, TaskReading *reading);
/* Which of the lanes that work on one environment; alone 0 of 1. */
typedef struct {
    int lane, lanes;
} TaskLane;
/* Appends the frame made from the readings to the history and writes the view. All lanes call. */
TASK_FN void task_observe_lane(TaskEnv *env, const TaskDef *def, const Robot *robot,
                               const RobotSim *sim, const TaskReading *reading, int first,
                               const TaskView *view, TaskLane at);
/* The same by one. */
TASK_FN void task_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                          const TaskReading *reading, int first, const TaskView *view);

/* Everything that reward terms may use, computed once per policy step (env.c). */
typedef struct {
    const TaskDef *def;
    const Robot *robot;
    const TaskEnv *env;
    double velocity[3];                   /* [m/s] of the base, heading frame */
    double omega[3];                      /* [rad/s] of the base, base frame */
    double gravity[3];                    /* [-] unit vector along gravity, base frame */
    double twist_change;                  /* norm of the change of the base twist in this step */
    double q[ROBOT_JOINTS_MAX];           /* [rad] */
    double qd[ROBOT_JOINTS_MAX];          /* [rad/s] */
    double qd_before[ROBOT_JOINTS_MAX];   /* [rad/s] one policy step ago */
    double torque[ROBOT_JOINTS_MAX];      /* [N m] */
    double base_height;                   /* [m] above the stance soles */
    double foot_height[ROBOT_FEET_MAX];   /* [m] lowest sole point above the undisturbed surface */
    double foot_force[ROBOT_FEET_MAX];    /* [N] of the ground on the foot */
    double foot_speed[ROBOT_FEET_MAX];    /* [m/s] horizontal, of the sole */
    double landed_air_time;               /* [s] summed over the feet that touched down */
    int contact[ROBOT_FEET_MAX];          /* bool: the ground carries the foot */
    int stance[ROBOT_FEET_MAX];           /* bool: the clock wants the foot in stance */
    int either[ROBOT_FEET_MAX];           /* bool: stance and swing are both right */
    double wanted_height[ROBOT_FEET_MAX]; /* [m] h_des of the clock */
    double foot_distance;                 /* [m] see robot_sim_foot_distance */
    double knee_distance;                 /* [m] see robot_sim_knee_distance */
    int standing;                         /* bool: the command is to stand */
} TaskMotion;
/* Describes the policy step just made. The sim is at the end of the step. env still has the base
 * twist, joint speeds, smoothed velocity and air times of the previous step, which are updated.
 * torque: [robot_joints] of the last physics step. */
TASK_FN TaskMotion task_describe_motion(TaskEnv *env, const TaskDef *def, const Robot *robot,
                                        const RobotSim *sim, const double *torque);
/* Writes the weighted terms per second to `terms`. Returns their clipped sum times the period. */
TASK_FN double task_reward(const TaskMotion *motion, double terms[TASK_REWARD_COUNT]);

/* What an environment keeps, and back, before a new episode (step.c). */
TASK_FN TaskKept task_keep(const TaskEnv *env);
TASK_FN void task_restore(TaskEnv *env, TaskKept kept);

/* Draws ground, robot and sensors of an episode (randomize.c). */
TASK_FN void task_randomize(TaskEnv *env, const TaskDef *def, const Robot *robot);
TASK_FN void task_draw_command(TaskEnv *env, const TaskDef *def);
/* Draws the ground of an episode: one material, or stripes of three (ground.c, crowd.inc). */
TASK_FN void task_draw_ground(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r);
/* Draws where on the map it begins, and a material for each of its labels. */
TASK_FN void task_draw_on_map(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r);
/* [m] Depth of the soles of a robot that stands on a material. */
double task_standing_depth(const Robot *robot, const MildMaterial *material);

/* A motor during a policy step. */
typedef struct {
    double target[2]; /* [rad] of the action now and of the one before */
    double kp;        /* [N m/rad] */
    double kd;        /* [N m s/rad] */
    double limit;     /* [N m] */
    double fastest;   /* [rad/s] 0: no limit */
} TaskMotor;

/* A policy step (step.c): what comes before its physics steps, the motor of joint i, its torque at
 * angle q and speed qd, and what comes after them. late: bool, the last action still counts.
 * torque: [joints] of the last physics step. diverged: bool, they broke off. */
TASK_FN void task_begin_step(TaskEnv *env, const TaskDef *def, const float *action);
TASK_FN TaskMotor task_motor(const TaskEnv *env, const TaskDef *def, const Robot *robot, int i);
TASK_FN double task_torque(const TaskMotor *motor, int late, double q, double qd);
TASK_FN TaskStep task_end_step(TaskEnv *env, const TaskDef *def, const Robot *robot,
                               const RobotSim *sim, const double *torque, int diverged);
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
                        const double *rotation, const double *qvel, double wrench[6]);
TASK_FN double task_assist_pose(const TaskEnv *env, const TaskDef *def, const Robot *robot, int i);

/* Gait clock (gait.c): a foot is in stance during the half of the period that starts at its
 * offset. */
TASK_FN int task_is_standing(const double command[3]);
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
