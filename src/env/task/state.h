/* What an environment is made of: plain structs without pointers that the CPU and a GPU share (see
 * numbers.h). Who steps the robot reads what it needs from a TaskEnv and answers with a
 * RobotReading. */
#ifndef TASK_STATE_H
#define TASK_STATE_H

#include <stddef.h>
#include <stdint.h>

#include "env/task/numbers.h"
#include "env/task/task_def.h"
#include "env/task/view.h"
#include "robot/table.h"

/* Why an episode ended; where several are true, task_end_cause names the first that follows. */
#define TASK_ENDS(X)                                                                               \
    X(time, "its length is over: no fall")                                                         \
    X(not_finite, "a number was not finite, or a speed above 1e3")                                 \
    X(tilt, "the base tilted more than task.tilt_limit")                                           \
    X(base, "a shell of the base, or of what is welded to it, touched the ground")                 \
    X(shell, "another shell that does not stand touched rigid ground")                             \
    X(crossing, "the feet were laterally closer than task.crossing_limit")                         \
    X(joint, "a joint was beyond its range by more than TASK_JOINT_BROKEN")
#define TASK_END_ENUM(name, help) TASK_END_##name,
typedef enum { TASK_ENDS(TASK_END_ENUM) TASK_END_COUNT } TaskEnd;
/* [TASK_END_COUNT] */
extern const char *const task_end_names[];

#define TASK_JOINT_BROKEN                                                                          \
    0.5 /* [rad] soft limits of light joints give way by half of it in a walk */

#define TASK_FRAMES 6 /* H + 1, newest last (paper, H = 5) */

/* A command: [m/s] forward, [m/s] to the left, [rad/s] turning left, all in the heading frame, and
 * [m] the rise of the base in a jump, 0: none. */
enum { TASK_FORWARD, TASK_LEFT, TASK_TURN, TASK_RISE, TASK_COMMANDS };

/* [-] Friction of rigid ground that a caller has chosen (task_env_reset_on). */
#define TASK_RIGID_FRICTION 0.8

/* The last numbers of a frame, behind those of the joints: name, bool: the TaskDef def has it, what
 * the TaskEnv env says of it, its sign in the mirror image of a robot. The networks look for the
 * clock at the end. */
#define TASK_FRAME_LIST(X)                                                                         \
    X(jump, def->jump[1] > 0, 5 * env->command_seen[TASK_RISE], 1)                                 \
    X(clock, 1, observe_clock(env, def, 0), robot_mirror_shift(robot) > 0 ? -1 : 1)                \
    X(clock, 1, observe_clock(env, def, 1), robot_mirror_shift(robot) > 0 ? -1 : 1)
#define TASK_FRAME_ONE(name, has, value, sign) "."
enum { TASK_FRAME_LAST = (int)sizeof(TASK_FRAME_LIST(TASK_FRAME_ONE)) - 1 }; /* rows of it */

/* A number of the scan (scan.h): [1/m] its scale, [m] beyond which it says no more. */
#define TASK_SCAN_SCALE 5
#define TASK_SCAN_CLIP REAL(1)
enum { TASK_SCAN_MAX = 256 }; /* points */

/* Numbers per environment; they follow from the robot's joints and feet, and from the task. */
typedef struct {
    int joints;
    int feet;
    int observation; /* one frame: angular velocity 3, command 3, gravity 3, joints' angles, speeds,
                        last actions, those of TASK_FRAME_LIST (observe.h) */
    int scan;        /* points of the height scan (scan.h); 0: none */
    int history;     /* TASK_FRAMES frames, then the scan */
    int actions;     /* one for each joint that is not driven (driven.h) */
    int estimates;   /* base velocity 3, feet velocities 3 each, feet heights */
    int critic;      /* frame, estimates, 6 of each foot, 34 of the episode (observe.h), scan */
} TaskShape;
enum { /* of a robot with ROBOT_JOINTS_MAX joints and ROBOT_FEET_MAX feet */
       TASK_OBSERVATION_MAX = 9 + 3 * ROBOT_JOINTS_MAX + TASK_FRAME_LAST,
       TASK_HISTORY_MAX = TASK_FRAMES * TASK_OBSERVATION_MAX + TASK_SCAN_MAX,
       TASK_ESTIMATES_MAX = 3 + 4 * ROBOT_FEET_MAX,
       TASK_CRITIC_MAX =
           TASK_OBSERVATION_MAX + TASK_ESTIMATES_MAX + 6 * ROBOT_FEET_MAX + 34 + TASK_SCAN_MAX
};
TaskShape task_shape(const TaskDef *def, const Robot *robot);
MILD_HD_FN float *task_row(float *rows, long i, int width) {
    return rows ? rows + i * width : NULL;
}
/* The rows from those of environment i on. */
MILD_HD_FN EnvsView task_view_from(const EnvsView *view, const TaskShape *shape, long i) {
    const EnvsView from = {task_row(view->history, i, shape->history),
                           task_row(view->critic, i, shape->critic),
                           task_row(view->estimate, i, shape->estimates),
                           task_row(view->frame, i, shape->observation)};
    return from;
}
/* First of the ground's numbers in the critic's input: TASK_GROUND_NUMBERS, then whether it is
 * rigid, where the numbers are 0. */
int task_critic_ground(const TaskShape *shape);
/* Numbers of the ground in the critic's input (task_ground_numbers). */
enum { TASK_GROUND_NUMBERS = 12 };

/* Mirror symmetry left <-> right: o'_i = sign_i o_index_i of a frame and, behind the newest one,
 * the scan; and actions alike. */
typedef struct {
    int observation_index[TASK_OBSERVATION_MAX + TASK_SCAN_MAX];
    float observation_sign[TASK_OBSERVATION_MAX + TASK_SCAN_MAX];
    int action_index[ROBOT_JOINTS_MAX];
    float action_sign[ROBOT_JOINTS_MAX];
} TaskMirror;
TaskMirror task_mirror(const TaskDef *def, const Robot *robot);

/* What differs from robot to robot; see RobotVariation. */
typedef struct {
    Real base_mass_add;                    /* [kg] */
    Real com_offset[3];                    /* [m] of the base's centre of mass */
    Real link_mass_scale[1 + TASK_JOINTS]; /* [-] base, bodies of the joints */
    Real armature_scale;                   /* [-] */
    Real rigid_friction;                   /* [-] */
    Real rigid_time;                       /* [s] */
    int rigid;                             /* bool: rigid ground, no soft one */
    int shells_stand;                      /* bool: as in RobotTable, in this episode */
} TaskVariation;

/* Where the robot is, in the order of robot.ini; see RobotState. */
typedef struct {
    Real qpos[7 + TASK_JOINTS]; /* [m, -, rad] base, quaternion w x y z, joints */
    Real qvel[6 + TASK_JOINTS]; /* [m/s, rad/s] base: world axes, base axes; joints */
} TaskPose;

/* What the task asks of a robot besides TaskEnv.robot, at the end of a policy step or at the start
 * of an episode: observations, rewards and the end of an episode are computed from it. MuJoCo's
 * robots fill it in task_env_read, the batch engine's in env_measure. */
typedef struct {
    Real rotation[9]; /* [-] base to world, row major */
    struct {
        Real force[3];                /* [N] of the ground on the foot, mean over a physics step */
        Real sole_height;             /* [m] lowest sole point above the undisturbed surface */
        Real sole_center[3];          /* [m] world */
        Real sole_center_velocity[3]; /* [m/s] */
        Real depth_mean;              /* [m] see MildFootResult */
    } foot[TASK_FEET];
    Real body_clearance; /* [m] see robot_sim_body_clearance */
    Real base_clearance; /* [m] see robot_sim_base_clearance */
    Real knee_distance;  /* [m] see robot_sim_knee_distance */
    Real foot_distance;  /* [m] see robot_sim_foot_distance */
    Real above;          /* [m] height of the base above the undisturbed surface under it */
} RobotReading;

/* What the sensors say, each with its own latency. */
typedef struct {
    Real omega[3], gravity[3]; /* base frame */
    Real q[TASK_JOINTS], qd[TASK_JOINTS];
} TaskSensors;

typedef struct {
    TaskShape shape;
    uint64_t seed;
    uint32_t index;      /* number of the environment, which selects its stream of random numbers */
    uint32_t tick;       /* policy steps since creation, never reset */
    uint32_t tick_first; /* at creation or when the run went on: then episodes are staggered */
    /* episode */
    uint32_t step;       /* policy steps on the clock of this episode */
    uint32_t step_limit; /* step at which the episode times out */
    uint32_t step_first; /* step at which the episode began */
    int dropped;         /* bool: the episode began lying, see TaskStart */
    double phase;        /* [-] gait clock in [0, 1) */
    Real command[TASK_COMMANDS];
    Real command_seen[TASK_COMMANDS]; /* what the policy sees, one policy step late */
    int command_frozen;               /* bool: eval and play set the command themselves */
    /* what was drawn for this episode */
    TaskVariation variation;
    int ground[MILD_MATERIALS_MAX];      /* of TaskDef.grounds, by label; unused without them */
    Real kp_scale[TASK_JOINTS];          /* [-] */
    Real kd_scale[TASK_JOINTS];          /* [-] */
    Real strength;                       /* [-] of all torques */
    Real motor_offset[TASK_JOINTS];      /* [rad] */
    int lag_command, lag_motor, lag_imu; /* [physics steps] */
    int lag_scan;                        /* [policy steps] */
    Real scan_offset;                    /* [m] error of the heights that it sees */
    double assist_level;  /* [-] level of assistance: decays while on its feet, rises with falls;
                             persists across episodes */
    double command_most;  /* [m/s or m] highest command, see task_command_adapt; persists */
    Real assist_draw;     /* [-] share of the level used in this episode, in [0.5, 1) */
    Real push[6];         /* [m/s, rad/s] last push, for the critic; decays */
    int drives;           /* bool: the driven joints move in this episode (driven.h) */
    uint32_t driven_tick; /* at which their goals were drawn */
    /* state */
    TaskPose robot;
    float action[3][TASK_JOINTS]; /* now, one and two steps ago; then those of driven joints */
    Real torque[TASK_JOINTS];     /* [N m] of the last physics step */
    uint32_t oldest;              /* place of the oldest frame in the ring, the next to go */
    uint32_t held;                /* frames of the ring */
    Real base_twist[6]; /* one policy step ago: linear in the world, angular in the base frame */
    Real smooth_velocity[3];       /* [m/s, m/s, rad/s] vx, vy, wz, heading frame, smoothed over
                                reward.tracking_time */
    Real joint_speed[TASK_JOINTS]; /* one policy step ago */
    Real air_time[TASK_FEET];
    Real risen[2]; /* [m] highest of the base above nominal: in this period of the clock, in the one
                    before */
    /* sums over the running episode, for the log */
    Real reward_sum, term_sum[TASK_REWARD_COUNT], speed_error_sum;
} TaskEnv;

/* What lasts beyond an episode. */
typedef struct {
    double assist_level;
    double command_most;
    uint64_t tick;
} TaskProgress;

/* Result of one policy step. */
typedef struct {
    float reward;
    uint8_t done, timeout,
        valid;     /* valid 0: the simulation diverged, and the sample must get no weight */
    uint8_t cause; /* TaskEnd where done */
    /* of the episode that just ended (done) */
    uint32_t length;
    float episode_reward, episode_terms[TASK_REWARD_COUNT], episode_speed_error;
} TaskStep;

/* A motor during a policy step. */
typedef struct {
    Real target[2]; /* [rad] of the action now and of the one before */
    Real kp;        /* [N m/rad] */
    Real kd;        /* [N m s/rad] */
    Real limit;     /* [N m] */
    Real fastest;   /* [rad/s] 0: no limit */
    Real full;      /* [rad/s] up to which it gives all of `limit`; 0: up to `fastest` */
} TaskMotor;

/* What the clock wants of a foot. */
typedef struct {
    int stance;  /* bool */
    int either;  /* bool: near touchdown and lift-off, where stance and swing are both right */
    Real height; /* [m] apex sin(pi s), s: progress of the swing, so that the foot leaves and meets
                    h0 on time */
    Real bend;   /* [-] of the swing leg in the reference motion */
} TaskFoot;

/* Everything that reward terms may use, computed once per policy step (task_describe_motion). */
typedef struct {
    const TaskDef *def;
    const RobotTable *robot;
    const TaskEnv *env;
    Real velocity[3];            /* [m/s] of the base, heading frame */
    Real omega[3];               /* [rad/s] of the base, base frame */
    Real gravity[3];             /* [-] unit vector along gravity, base frame */
    Real twist_change;           /* norm of the change of the base twist in this step, or of its
                                      linear part (acceleration_form) */
    Real q[TASK_JOINTS];         /* [rad] */
    Real qd[TASK_JOINTS];        /* [rad/s] */
    Real qd_before[TASK_JOINTS]; /* [rad/s] one policy step ago */
    Real torque[TASK_JOINTS];    /* [N m] */
    Real base_height;            /* [m] above the stance soles; in flight, as `above` */
    Real rise; /* [m] of the base over its nominal height above the undisturbed surface */
    Real foot_height[TASK_FEET]; /* [m] lowest sole point above the undisturbed surface */
    Real foot_force[TASK_FEET];  /* [N] of the ground on the foot */
    Real foot_speed[TASK_FEET];  /* [m/s] horizontal, of the sole */
    Real landed_air_time;        /* [s] summed over the feet that touched down */
    int contact[TASK_FEET];      /* bool: the ground carries the foot */
    TaskFoot wanted[TASK_FEET];  /* by the clock */
    Real foot_distance;          /* [m] see robot_sim_foot_distance */
    Real knee_distance;          /* [m] see robot_sim_knee_distance */
    int standing;                /* bool: the command is to stand */
} TaskMotion;

#endif
