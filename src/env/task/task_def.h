/* The task's configuration: sections [task], [reward], [randomize] of a config file. Defaults are
 * complete. */
#ifndef MILD_TASK_DEF_H
#define MILD_TASK_DEF_H

#include "base/hd.h"
#include "mild/error.h"
#include "mild/field.h"
#include "mild/map.h"
#include "robot/table.h"

typedef struct Robot Robot;

#define TASK_PERIOD 0.01   /* [s] policy step: 100 Hz (paper) */
#define TASK_STRIDE_MAX 16 /* greatest task.history_stride */

/* Every reward term once: name, default weight, help. The struct, the config keys and the table of
 * functions (reward.h) are all made from this list. Weights are per second; source: paper Table II
 * and docs/task.md section 8. */
#define TASK_REWARD_LIST(X)                                                                        \
    X(linear_velocity, 2.0,                                                                        \
      "f(v_x - command) f(v_y - command), f(e) = (1 - n) exp(-k e^2) + n exp(-|e|/width), n: "     \
      "tracking_narrow, v smoothed, in the heading frame (after the paper)")                       \
    X(yaw_rate, 1.1, "f(w_z - command) (after the paper)")                                         \
    X(feet_clearance, 2.4,                                                                         \
      "the height of swing feet, see clearance_form; h: lowest sole point above the undisturbed "  \
      "surface (after the paper)")                                                                 \
    X(gait, 1.4, "feet whose contact matches the clock, see gait_form (after the paper)")          \
    X(slip, -0.1, "the horizontal speed [m/s] of feet in contact (paper)")                         \
    X(base_acceleration, 0.2,                                                                      \
      "exp(-3 |change of base twist in one step|), see acceleration_form (after the paper)")       \
    X(action_smoothness, -0.003, "|a - a1|^2 + |a - 2 a1 + a2|^2 (paper)")                         \
    X(reference_motion, 2.2, "exp(-2 d) - 0.2 min(d, 0.5), d = |q - q_ref(phase)| (vendor)")       \
    X(default_pose, 1.2,                                                                           \
      "keeping joints marked still in robot.ini near the default pose (vendor)")                   \
    X(base_height, 0.2, "exp(-100 |height above the stance soles - nominal|) (vendor)")            \
    X(feet_distance, 0.2, "keeping the lateral distance of the feet in feet_range (vendor)")       \
    X(knee_distance, 0.2, "keeping the lateral distance of the knees in knee_range (vendor)")      \
    X(orientation, 1.5, "an upright base (vendor)")                                                \
    X(air_time, 1.0,                                                                               \
      "the time in the air [s], paid at touchdown, at most the swing of the clock (vendor)")       \
    X(base_motion, 0.5, "little vertical, roll and pitch motion of the base (vendor)")             \
    X(contact_force, -0.02,                                                                        \
      "the foot force [N] above foot_force of robot.ini times 0.5/stance_share, at most 0.8 of "   \
      "that (vendor)")                                                                             \
    X(torque, -1e-10, "the sum of squared torques [N^2 m^2] (vendor)")                             \
    X(joint_speed, -1e-5, "the sum of squared joint speeds [rad^2/s^2] (vendor)")                  \
    X(joint_acceleration, -5e-9, "the sum of squared joint accelerations [rad^2/s^4] (vendor)")    \
    X(power, 0, "the sum of |torque times speed| of the joints [W] (field)")                       \
    X(upright, 0,                                                                                  \
      "(1 - g_z)/2, g_z: unit gravity along the base's z axis; 1 upright, 0 on its back")          \
    X(rise, 0, "the height above the stance soles over the nominal one, in [0, 1]")                \
    X(jump, 0,                                                                                     \
      "exp(-|e|/0.05 m) f(v_x - command) in the flight of a jump, e: the base's height less that " \
      "of the free flight which the clock asks for; f: see linear_velocity")                       \
    X(collision, -1.0,                                                                             \
      "feet or knees being closer than feet_least, knee_least of robot.ini (vendor)")

#define TASK_REWARD_ENUM(name, weight, help) REWARD_##name,
enum { TASK_REWARD_LIST(TASK_REWARD_ENUM) TASK_REWARD_COUNT };
#undef TASK_REWARD_ENUM

/* Forms of a reward: ours, and the paper's formula to the letter (lab/paper/deviations.md). Rise is
 * for feet that sink deep. */
typedef enum {
    TASK_CLEARANCE_LIFT,
    TASK_CLEARANCE_ERROR,
    TASK_CLEARANCE_RISE,
    TASK_CLEARANCES
} TaskClearance;
typedef enum { TASK_GAIT_MEAN, TASK_GAIT_SUM, TASK_GAITS } TaskGait;
typedef enum {
    TASK_ACCELERATION_TWIST,
    TASK_ACCELERATION_LINEAR,
    TASK_ACCELERATIONS
} TaskAcceleration;

/* How an episode begins: on its feet in the default pose, or dropped with any angles of the joints
 * on its back, on a side, or in any attitude. */
typedef enum {
    TASK_START_STAND,
    TASK_START_BACK,
    TASK_START_SIDE,
    TASK_START_ANY,
    TASK_STARTS
} TaskStart;

/* Gaits: name, phases at which the stances of four feet begin, front left, front right, rear left,
 * rear right; a biped has the first two. What walks at one stance_share runs at another. The Go1's
 * hop is a pronk, its skip a gallop, which has no mirror image. */
#define TASK_GAIT_LIST(X)                                                                          \
    X(trot, 0, 0.5, 0.5, 0)                                                                        \
    X(pace, 0, 0.5, 0, 0.5)                                                                        \
    X(bound, 0, 0, 0.5, 0.5)                                                                       \
    X(hop, 0, 0, 0, 0)                                                                             \
    X(skip, 0, 0.3, 0.5, 0.8)

typedef struct {
    double weight[TASK_REWARD_COUNT]; /* [1/s] */
    int clip_sum;                     /* bool: the sum of a step is never below 0 (vendor) */
    int gate; /* [-] power of (1 - g_z)/2 on all terms with a positive weight but upright */
    double nominal_height;     /* [m] of the base above the stance soles; 0: the robot's */
    double tracking_sharpness; /* [s^2/m^2] k = 5 in the velocity terms */
    double tracking_narrow;    /* [-] share of the narrow part of the velocity terms */
    double tracking_width;     /* [m/s] of the narrow part */
    double tracking_time;      /* [s] over which the tracked velocity is smoothed */
    double feet_range[2], knee_range[2]; /* [m] limits; 0 0: the robot's */
    double reference_amplitude;          /* [rad] */
    int clearance_form;                  /* a TaskClearance */
    int gait_form;                       /* a TaskGait */
    int acceleration_form;               /* a TaskAcceleration */
} RewardDef;

/* Of RandomizeDef.model: a preset keeps its law, and a ground drawn from the ranges has that of
 * mild_merged where it stays dented, else that of mild. */
enum { TASK_MODEL_OWN = MILD_MODELS };
enum { TASK_TEXT_SIZE = 152 }; /* characters of a list of grounds, as long as a config's text */

/* Domain randomisation; ranges are uniform. docs/task.md section 11. */
typedef struct {
    int model; /* MildModel of the soft episodes, to which draws are matched; rigid: all on the
                  engine's contact; or TASK_MODEL_OWN */
    /* ground: shares of episodes; what remains after rigid and preset draws from the paper's ranges
     */
    double rigid_share;           /* [-] engine contact */
    double rigid_time[2];         /* [s] its time constant; 0 0: the robot's own contact */
    double preset_share;          /* [-] a named preset, parameters times 1 +- preset_jitter */
    double preset_jitter;         /* [-] */
    char presets[TASK_TEXT_SIZE]; /* presets and files of soils that take the presets' place, see
                                     task_soils_open; "": the presets of mild */
    double patch_share;           /* [-] soft episodes whose ground changes in stripes */
    double patch_length[2];       /* [m] */
    double k_pen[2], sigma_cone[2], alpha[2], nu[2], c_g[2], c_d[2], phi[2], mu[2], rho[2],
        k_drift[2], b_drift[2], recovery[2], bed_depth[2];
    double slip_share;     /* [-] soft grounds that stay dented, on which slip costs support */
    double slip_length[2]; /* [m] there */
    double grip[2];        /* [-] there */
    int passive;           /* bool: of the materials, see MildMaterial */
    double sinkage_max; /* [m] a draw whose one-foot static sinkage is deeper is made stiffer until
                           it fits */
    /* robot */
    double shells_share;  /* [-] episodes in which its shells stand, if task.shells_stand */
    double base_mass[2];  /* [kg] added */
    double com_offset;    /* [m] each axis, +- */
    double link_mass[2];  /* [-] */
    double armature[2];   /* [-] */
    double motor_offset;  /* [rad] +- */
    double gain[2];       /* [-] Kp and Kd, each joint */
    double strength[2];   /* [-] torque */
    double latency[2];    /* [s] command, motor reading, IMU reading: each drawn per episode */
    double scan_noise;    /* [m] +- of each height of the scan */
    double scan_offset;   /* [m] +- of all heights of an episode */
    double scan_delay[2]; /* [s] from the scan to the policy */
    double scan_drop;     /* [-] share of its numbers that read 0 */
    double push_interval; /* [s] 0: none */
    double push_linear, push_angular; /* [m/s], [rad/s] */
    double initial_joint;             /* [rad] +- around the default pose */
    double initial_velocity;          /* [m/s] +- of the base */
} RandomizeDef;

enum { TASK_GAINS_SIZE = 152 }; /* characters of a list of gains, as long as a config's text */

typedef struct {
    double physics_dt;                  /* [s] */
    double action_scale;                /* [rad] per unit action; 0: the robot's */
    double action_clip;                 /* [-] */
    int torque_hold;                    /* bool: one torque per policy step */
    char torque_share[TASK_GAINS_SIZE]; /* [-] of the joint's effort: numbers, see task_gains */
    char kp[TASK_GAINS_SIZE];       /* [N m/rad] "robot": the robot's; or numbers, see task_gains */
    char kd[TASK_GAINS_SIZE];       /* [N m s/rad] */
    char actuator[TASK_GAINS_SIZE]; /* file of an actuator network; "": the PD */
    int start;                      /* a TaskStart */
    double start_share; /* [-] of the episodes on soft ground; the others begin on their feet */
    double settle;      /* [s] at the start of those in which the motors only damp */
    int may_lie;        /* bool: neither tilt nor a shell of the base that stands ends an episode */
    double episode;     /* [s] */
    double command_interval; /* [s] */
    double vx[2], vy[2], wz[2];
    double vx_start;        /* [m/s] highest forward command of a new robot: task_command_adapt */
    double jump[2];         /* [m] rise of the base in a jump; 0 0: the robot does not jump */
    double jump_start;      /* [m] highest one of a new robot: task_command_adapt */
    double jump_stance;     /* [s] on the feet between two flights */
    double driven_share;    /* [-] episodes in which the driven joints move (driven.h) */
    double driven_range;    /* [-] of the way from their pose to the ends of their range */
    double driven_speed[2]; /* [rad/s] their greatest speed, drawn with each goal */
    double backward_share, backward_vx[2], standing_share, straight_share;
    double standing_below; /* [m/s, rad/s] a command whose parts are all below this is to stand */
    int gait;              /* of task_gait_names; 0: the robot's own */
    double gait_period;    /* [s] of fast commands, see task_gait_period */
    double gait_slowing, gait_slow_below; /* [-], [m/s] of slow ones */
    double speed_hold;                    /* [-] see control/speed_hold.h; 0: off */
    double speed_hold_most;               /* [m/s] of the commands it makes; 0: no bound */
    double stance_share[2]; /* [-] of the period: running, walking; see task_gait_share */
    double run_speed[2];    /* [m/s] up to which it walks, from which it runs */
    double swing_apex;      /* [m] */
    double double_support;  /* [-] |sin(2 pi phase)| below which either contact state is right */
    int history_stride;     /* policy steps that each older frame of the history is the mean of */
    int clock;              /* bool: clock in the observation */
    int observe_noise;      /* bool */
    double noise_q, noise_qd, noise_omega, noise_gravity; /* +- uniform, qd after scaling */
    int scan;              /* points across the height scan (scan.h); 0: there is none */
    double scan_ahead[2];  /* [m] rearmost and foremost points, from the base */
    double scan_pitch;     /* [m] from point to point */
    int scan_hold;         /* policy steps from one scan to the next */
    double velocity_scale; /* [-] of the base velocity among the estimates. 0.05 m/s is a tenth of a
                              slow walk, so it must matter to the regression and to the actor */
    double height_scale; /* [-] of the feet heights, so that centimetres count as much as velocities
                              in m/s */
    double tilt_limit;   /* [rad] */
    double crossing_limit;    /* [m] lateral distance of the feet below which the episode ends */
    int shells_stand;         /* bool: shells stand (robot_set_shells) */
    int sole_elements;        /* of a foot (robot_set_elements); 0: the robot's own */
    int assist;               /* bool: helping hand for beginners (assist.h) */
    double assist_decay;      /* [s] */
    int solver;               /* MildSolver */
    double contact_tolerance; /* [-] relative residual at which the contact solver stops */
    int contact_float;        /* bool: on a CPU the ground steps in float (float_ground.h) */
    int contact_iterations;   /* [-] hard bound of its work */
    RewardDef reward;
    RandomizeDef randomize;
    /* not of the config */
    const MildMap *map; /* borrowed: shape of the ground, and the pattern of the soft one; NULL:
                           level, one material */
    int imprint_tiles;  /* of imprints, see mild_ground_bytes_imprints */
    const struct TaskActuator *motors; /* borrowed: of the file `actuator`; NULL: the PD */
    const struct TaskSoils *soils; /* borrowed: of randomize.presets; NULL: the presets of mild */
    const struct TaskGrounds *grounds; /* borrowed: what episodes draw their ground from; NULL: from
                                          the ranges */
} TaskDef;
typedef struct TaskGrounds TaskGrounds;

/* What turns the errors of the joints into torques, in the place of their PD, on the CPU. `torque`
 * is called at every physics step, because it may remember: [joints] target minus angle [rad] and
 * speed [rad/s] -> [N m], before the drawn strength and the limits of the motors. state: `bytes` of
 * the environment, a multiple of 64, all 0 when an episode begins. */
typedef struct TaskActuator {
    const void *self;
    size_t bytes;
    void (*torque)(const void *self, void *state, const double *error, const double *speed,
                   double *torque);
} TaskActuator;

TaskDef task_def_default(void);
/* For evaluation and play, on grounds that the caller chooses: no draw of them, no assistance, the
 * robot's own soles; shells stand in all episodes. */
void task_def_choose_ground(TaskDef *def);
/* A model with the soles of RandomizeDef.model, for robot_set_model. */
MildModel task_model_soles(int model);
/* The same and the nominal robot, undisturbed; sensor noise, latencies and the start
 * are still drawn. */
void task_def_make_nominal(TaskDef *def);
MildStatus task_def_check(const TaskDef *def, MildError *error);
/* Fails for a task with jumps, which `what` does not command, or with a scan, which it has not. */
MildStatus task_def_check_plain(const TaskDef *def, const char *what, MildError *error);
/* The same as task_def_check, that the lists of gains fit the robot, and that a file of an actuator
 * has been read. */
MildStatus task_def_check_robot(const TaskDef *def, const Robot *robot, MildError *error);
/* robot_set_gait and robot_set_elements by the def. */
MildStatus task_set_robot(const TaskDef *def, Robot *robot, MildError *error);
/* Gains of each joint [robot_joints]; 0 beyond the robot's joints. */
typedef struct {
    double kp[ROBOT_JOINTS_MAX];    /* [N m/rad] task.kp or the robot's */
    double kd[ROBOT_JOINTS_MAX];    /* [N m s/rad] task.kd or the robot's */
    double limit[ROBOT_JOINTS_MAX]; /* [N m] task.torque_share of the joint's effort */
} TaskGains;
/* Each list of the def has one number, one per joint, or one per joint of a leg, which every leg
 * repeats. */
MildStatus task_gains(const TaskDef *def, const Robot *robot, TaskGains *gains, MildError *error);
/* [rad] What the def or, where it has 0, the robot says. */
MILD_HD_FN double task_action_scale(const TaskDef *def, const RobotTable *robot) {
    return def->action_scale > 0 ? def->action_scale : robot->action_scale;
}

/* [m] The same. */
MILD_HD_FN double task_nominal_height(const TaskDef *def, const RobotTable *robot) {
    return def->reward.nominal_height > 0 ? def->reward.nominal_height : robot->nominal_height;
}

extern const char *const task_start_names[TASK_STARTS];
extern const char *const task_gait_names[];
extern const MildField task_fields[];
extern const int task_field_count;
extern const MildField reward_fields[]; /* offsets into RewardDef */
extern const int reward_field_count;
extern const MildField randomize_fields[]; /* offsets into RandomizeDef */
extern const int randomize_field_count;
extern const char *const task_reward_names[];

#endif
