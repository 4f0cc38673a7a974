#include "env/task/task_def.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "env/task/scan.h"
#include "robot/float/float_ground.h"
#include "robot/robot.h"

#define KP_MAX 500.0 /* [N m/rad] */
#define KD_MAX 50.0  /* [N m s/rad] */

#define TASK_REWARD_NAME(name, weight, help) #name,
const char *const task_reward_names[] = {TASK_REWARD_LIST(TASK_REWARD_NAME)};

TaskDef task_def_default(void) {
    TaskDef def = {
        .physics_dt = 0.0025,
        .action_clip = 8.0,
        .torque_share = "0.85",
        .torque_hold = 0,
        .kp = "robot",
        .kd = "robot",
        .start_share = 1,
        .settle = 1,
        .episode = 24,
        .command_interval = 8,
        .vx = {0, 1.2},
        .vx_start = 4,
        .jump_start = 0.05,
        .jump_stance = 0.6,
        .vy = {-0.3, 0.3},
        .wz = {-1.5, 1.5},
        .driven_share = 0.8,
        .driven_range = 0.5,
        .driven_speed = {0.2, 2},
        .backward_share = 0.1,
        .backward_vx = {-0.6, 0},
        .standing_share = 0.05,
        .straight_share = 0.4,
        .standing_below = 0.1,
        .gait_period = 0.8,
        .gait_slow_below = 1.2,
        .stance_share = {0.5, 0.5},
        .run_speed = {1.5, 2.5},
        .swing_apex = 0.10,
        .double_support = 0.1,
        .history_stride = 8,
        .clock = 1,
        .observe_noise = 1,
        .noise_q = 0.03,
        .noise_qd = 0.19,
        .noise_omega = 0.3,
        .noise_gravity = 0.075,
        .scan_ahead = {-0.3, 0.7},
        .scan_pitch = 0.1,
        .scan_hold = 3,
        .velocity_scale = 4,
        .height_scale = 10,
        .tilt_limit = 1.0,
        .crossing_limit = -1.0,
        .shells_stand = 1,
        .assist = 1,
        .assist_decay = 8,
        .solver = MILD_SOLVER_NEWTON,
        .contact_tolerance = 1e-4,
        .contact_iterations = 20,
        .reward = {.clip_sum = 1,
                   .tracking_sharpness = 5,
                   .tracking_narrow = 0.5,
                   .tracking_width = 0.1,
                   .tracking_time = 0.4,
                   .reference_amplitude = 0.40},
        .randomize = {.model = TASK_MODEL_OWN,
                      .rigid_share = 0.1,
                      .preset_share = 0.5,
                      .preset_jitter = 0.2,
                      .patch_share = 0.3,
                      .patch_length = {1.0, 3.0},
                      .k_pen = {8, 1400},
                      .sigma_cone = {0.01e6, 0.24e6},
                      .alpha = {0.698, 1.310},
                      .nu = {0.8, 2.4},
                      .c_g = {-1.4, 4.6},
                      .c_d = {-6, 28},
                      .phi = {0.50, 0.64},
                      .mu = {0.2, 1.3},
                      .rho = {1000, 1000},
                      .k_drift = {400, 400},
                      .b_drift = {0.10, 0.10},
                      .recovery = {0, 1},
                      .bed_depth = {0.10, 0.15},
                      .slip_share = 1,
                      .slip_length = {0.001, 0.01},
                      .grip = {0.08, 0.3},
                      .passive = 1,
                      .sinkage_max = 0.07,
                      .shells_share = 1,
                      .base_mass = {-4, 4},
                      .com_offset = 0.006,
                      .link_mass = {0.9, 1.1},
                      .armature = {0.7, 1.3},
                      .motor_offset = 0.035,
                      .gain = {0.9, 1.1},
                      .strength = {0.9, 1.1},
                      .latency = {0.001, 0.010},
                      .scan_noise = 0.02,
                      .scan_offset = 0.03,
                      .scan_delay = {0.02, 0.06},
                      .scan_drop = 0.02,
                      .push_interval = 8,
                      .push_linear = 0.4,
                      .push_angular = 0.6,
                      .initial_joint = 0.05,
                      .initial_velocity = 0.1},
    };
#define TASK_REWARD_WEIGHT(name, value, help) def.reward.weight[REWARD_##name] = value;
    TASK_REWARD_LIST(TASK_REWARD_WEIGHT)
    return def;
}

MildModel task_model_soles(int model) {
    return model == TASK_MODEL_OWN ? MILD_MODEL_MILD : (MildModel)model;
}

void task_def_choose_ground(TaskDef *def) {
    RandomizeDef *r = &def->randomize;
    r->rigid_share = 0;
    r->rigid_time[0] = r->rigid_time[1] = 0;
    r->preset_share = 1;
    r->preset_jitter = 0;
    r->slip_share = 0;
    r->presets[0] = '\0';
    r->patch_share = 0;
    r->shells_share = 1;
    def->assist = 0;
    def->sole_elements = 0;
    def->start = TASK_START_STAND;
    def->may_lie = 0;
}

void task_def_make_nominal(TaskDef *def) {
    RandomizeDef *r = &def->randomize;
    task_def_choose_ground(def);
    def->driven_share = 0;
    r->base_mass[0] = r->base_mass[1] = 0;
    r->com_offset = r->motor_offset = 0;
    r->link_mass[0] = r->link_mass[1] = 1;
    r->armature[0] = r->armature[1] = 1;
    r->gain[0] = r->gain[1] = 1;
    r->strength[0] = r->strength[1] = 1;
    r->push_interval = 0;
}

#define D MILD_FIELD_DOUBLE
#define B MILD_FIELD_BOOL
#define T(member, type, count, min, max, help)                                                     \
    MILD_FIELD(TaskDef, member, type, count, min, max, help)
#define TASK_GAIT_NAME(name, a, b, c, d) #name,
#define TASK_GAIT_OFFSETS(name, a, b, c, d) {a, b, c, d},
const char *const task_gait_names[] = {"robot", TASK_GAIT_LIST(TASK_GAIT_NAME)};
static const double gait_offsets[][4] = {{0}, TASK_GAIT_LIST(TASK_GAIT_OFFSETS)};
const char *const task_start_names[TASK_STARTS] = {"stand", "back", "side", "any"};
const MildField task_fields[] = {
    T(physics_dt, D, 1, 0.0005, 0.01, "[s] physics step; must divide 0.01, the policy step"),
    T(action_scale, D, 1, 0, 2, "[rad] joint offset per unit of action; 0: the robot's"),
    T(action_clip, D, 1, 0.1, 100, "[-] actions are clipped to plus or minus this"),
    T(torque_share, MILD_FIELD_TEXT, TASK_GAINS_SIZE, 0, 0,
      "[-] torque limit as a share of the joint's effort, from 0.1 to 1: one number, one per "
      "joint, or one per joint of a leg"),
    T(torque_hold, B, 1, 0, 1,
      "[bool] the PD torque is computed once per policy step, when the action arrives, and held "
      "(paper: 100 Hz); false: at every physics step"),
    T(kp, MILD_FIELD_TEXT, TASK_GAINS_SIZE, 0, 0,
      "[N m/rad] position gain: robot, one number, one per joint, or one per joint of a leg"),
    T(kd, MILD_FIELD_TEXT, TASK_GAINS_SIZE, 0, 0, "[N m s/rad] as kp"),
    T(actuator, MILD_FIELD_TEXT, TASK_GAINS_SIZE, 0, 0,
      "[text] file of an actuator network, written by `mild actuator fit`, in the place of the PD; "
      "empty: none"),
    MILD_FIELD_CHOICE(TaskDef, start, task_start_names, TASK_STARTS,
                      "[-] how episodes begin: stand, on the feet; or dropped with any angles of "
                      "the joints on the back, on a side, in any attitude"),
    T(start_share, D, 1, 0, 1,
      "[-] share of the episodes on soft ground that begin so; the others stand"),
    T(settle, D, 1, 0, 10, "[s] time after such a start in which the motors only damp"),
    T(may_lie, B, 1, 0, 1,
      "[bool] neither tilt nor a shell of the base that stands ends an episode"),
    T(episode, D, 1, 0.1, 1000, "[s] longest episode"),
    T(command_interval, D, 1, 0.1, 1000, "[s] time after which a new command is drawn"),
    T(vx, D, 2, -4, 4, "[m/s] forward command, low and high"),
    T(vx_start, D, 1, 0.1, 4,
      "[m/s] highest forward command of a new robot; it grows as commands near it are followed"),
    T(jump, D, 2, 0, 1,
      "[m] rise of the base that a command to jump asks for, low and high; every command but that "
      "to stand is one, and vx, vy, wz are the means over its jumps; 0 0: the robot does not jump"),
    T(jump_start, D, 1, 0.01, 1,
      "[m] highest rise of a new robot; it grows, in the place of vx_start, as jumps succeed"),
    T(jump_stance, D, 1, 0.1, 3, "[s] time on the feet between two jumps"),
    T(vy, D, 2, -3, 3, "[m/s] sideways command, low and high"),
    T(wz, D, 2, -3, 3, "[rad/s] turning command, low and high"),
    T(driven_share, D, 1, 0, 1,
      "[-] share of episodes in which the joints that robot.ini calls driven go to random goals, a "
      "new one every 1 to 3 s; in the others they hold the pose"),
    T(driven_range, D, 1, 0, 1,
      "[-] how far such a goal is at most from the pose, as a share of the way to the joint's "
      "limits"),
    T(driven_speed, D, 2, 0.01, 20,
      "[rad/s] speed with which a driven joint goes to a goal, drawn with it, low and high"),
    T(backward_share, D, 1, 0, 1, "[-] share of commands to walk backward"),
    T(backward_vx, D, 2, -4, 4, "[m/s] backward command, low and high"),
    T(standing_share, D, 1, 0, 1, "[-] share of commands to stand"),
    T(straight_share, D, 1, 0, 1,
      "[-] share of walking commands without sideways and turning motion"),
    T(standing_below, D, 1, 0, 10,
      "[m/s, rad/s] a command whose three parts are all below this is to stand; 0: none is"),
    MILD_FIELD_CHOICE(
        TaskDef, gait, task_gait_names, sizeof task_gait_names / sizeof *task_gait_names,
        "[-] which feet stand together: robot, as offset of robot.ini says; bipeds hop "
        "or skip, the Go1 trots, paces, bounds, hops (pronks) or skips (gallops)"),
    T(gait_period, D, 1, 0.2, 3, "[s] period of the gait clock"),
    T(gait_slowing, D, 1, 0, 3,
      "[-] share by which the clock's period grows at no speed; at gait_slow_below it does not"),
    T(gait_slow_below, D, 1, 0.01, 10,
      "[m/s] speed |vx| + 3 |vy| + 1 m |wz| from which the period is gait_period"),
    T(stance_share, D, 2, 0.1, 0.9,
      "[-] share of the period that a foot stands, of a run and of a walk; below 0.5 a biped "
      "flies"),
    T(run_speed, D, 2, 0, 4,
      "[m/s] forward speed up to which the share is a walk's and from which it is a run's, linear "
      "between"),
    T(speed_hold, D, 1, 0, 1,
      "[-] eval, play and drive correct the commanded speed by the policy's own estimate of it, "
      "and the turn by the gyro: least weight of a gait cycle; 0: not at all"),
    T(speed_hold_most, D, 1, 0, 4,
      "[m/s] the speed hold raises no forward command above this, e.g. the highest in training: "
      "above it a policy may run slower or stop; 0: no bound"),
    T(swing_apex, D, 1, 0.01, 0.4,
      "[m] height of the swing foot above the undisturbed surface that the clock asks for"),
    T(double_support, D, 1, 0, 1,
      "[-] while |sin| of the clock is below this, stance and swing are both right"),
    T(history_stride, MILD_FIELD_INT, 1, 1, TASK_STRIDE_MAX,
      "[-] number of policy steps averaged in each of the five older frames of the history"),
    T(clock, B, 1, 0, 1, "[bool] the observation contains the gait clock"),
    T(observe_noise, B, 1, 0, 1, "[bool] the observation contains sensor noise"),
    T(noise_q, D, 1, 0, 1, "[rad] bound of the uniform noise of joint angles"),
    T(noise_qd, D, 1, 0, 5, "[-] bound of the uniform noise of joint speeds, in units of 20 rad/s"),
    T(noise_omega, D, 1, 0, 5, "[rad/s] bound of the uniform noise of the angular velocity"),
    T(noise_gravity, D, 1, 0, 1, "[-] bound of the uniform noise of the unit vector along gravity"),
    T(scan, MILD_FIELD_INT, 1, 0, 64,
      "[-] points across the height scan, by which actor, encoder and critic see the ground; 0: "
      "they do not"),
    T(scan_ahead, D, 2, -2, 4,
      "[m] its rearmost and foremost points, from the base along its heading"),
    T(scan_pitch, D, 1, 0.01, 1, "[m] from point to point, along and across"),
    T(scan_hold, MILD_FIELD_INT, 1, 1, 10,
      "[-] policy steps from one scan to the next: 3 are 33 Hz"),
    T(velocity_scale, D, 1, 0.01, 100,
      "[-] scale of the base velocity among the estimates; its error counts with the square"),
    T(height_scale, D, 1, 0.01, 100, "[-] scale of the feet heights among the estimates"),
    T(tilt_limit, D, 1, 0.1, 3.1, "[rad] the episode ends when the base tilts more than this"),
    T(crossing_limit, D, 1, -1, 1,
      "[m] the episode ends when the feet are laterally closer than this; -1: never"),
    T(shells_stand, B, 1, 0, 1,
      "[bool] geoms of `shells` of robot.ini stand on the ground as soles do; either way a shell "
      "of the base ends the episode when it touches the ground; another one only on rigid ground, "
      "and only if it does not stand"),
    T(sole_elements, MILD_FIELD_INT, 1, 0, 4096,
      "[-] ground elements of a flat sole, fewer than the robot's: a coarser raster with the same "
      "area and second moments of area, which does not change the ground; 0: the robot's own"),
    T(assist, B, 1, 0, 1,
      "[bool] an external force assists early training; it fades while a robot stays on its feet"),
    T(assist_decay, D, 1, 0.1, 1000, "[s] time constant with which it fades"),
    MILD_FIELD_CHOICE(
        TaskDef, solver, mild_solver_names, MILD_SOLVERS,
        "contact solver: newton (fast); gauss_seidel, the paper's sweeps over the same "
        "implicit equations; explicit, its Algorithm 1 to the letter"),
    T(contact_tolerance, D, 1, 1e-12, 0.1,
      "[-] relative residual at which the contact solver stops"),
    T(contact_float, B, 1, 0, 1,
      "[bool] training and eval on a CPU compute the ground's loops over elements in float, in "
      "vectors of twice as many; needs solver = newton and contact_tolerance of at least 1e-4. A "
      "GPU always does"),
    T(contact_iterations, MILD_FIELD_INT, 1, 1, 100000,
      "[-] most iterations of the contact solver per step"),
};
const int task_field_count = sizeof task_fields / sizeof *task_fields;

#define R(member, type, count, min, max, help)                                                     \
    MILD_FIELD(RewardDef, member, type, count, min, max, help)
#define TASK_REWARD_FIELD(name, value, help)                                                       \
    {#name,                                                                                        \
     MILD_FIELD_DOUBLE,                                                                            \
     offsetof(RewardDef, weight) + sizeof(double) * REWARD_##name,                                 \
     1,                                                                                            \
     -1e3,                                                                                         \
     1e3,                                                                                          \
     "[1/s] weight of " help,                                                                      \
     NULL},
static const char *const clearance_names[TASK_CLEARANCES] = {"lift", "error", "rise"};
static const char *const gait_names[TASK_GAITS] = {"mean", "sum"};
static const char *const acceleration_names[TASK_ACCELERATIONS] = {"twist", "linear"};
const MildField reward_fields[] = {
    TASK_REWARD_LIST(TASK_REWARD_FIELD)
        R(clip_sum, B, 1, 0, 1, "[bool] the reward of a step is never below 0"),
    R(gate, MILD_FIELD_INT, 1, 0, 16,
      "[-] power of (1 - g_z)/2, see upright, by which all other terms with a positive weight are "
      "multiplied; 0: none"),
    R(nominal_height, D, 1, 0, 2, "[m] base height above the stance soles; 0: the robot's"),
    R(tracking_time, D, 1, 0.01, 10,
      "[s] time over which the velocity is smoothed before it is compared with the command"),
    R(tracking_sharpness, D, 1, 0, 100, "[s^2/m^2] k in linear_velocity and yaw_rate"),
    R(tracking_narrow, D, 1, 0, 1,
      "[-] share n of exp(-|e|/width) in linear_velocity and yaw_rate; 0: the paper's"),
    R(tracking_width, D, 1, 0.001, 10, "[m/s, rad/s] width in linear_velocity and yaw_rate"),
    R(feet_range, D, 2, 0, 1, "[m] limits of the lateral distance of the feet; 0 0: the robot's"),
    R(knee_range, D, 2, 0, 1, "[m] limits of the lateral distance of the knees; 0 0: the robot's"),
    R(reference_amplitude, D, 1, 0, 1, "[rad] amplitude of the joints in reference_motion"),
    MILD_FIELD_CHOICE(
        RewardDef, clearance_form, clearance_names, TASK_CLEARANCES,
        "[-] feet_clearance: lift, (pi/2) (clip(h, 0, h_des) minus half of the "
        "excess)/apex; error, the paper's |h_des - h| [m]; rise, lift from the depth d of the "
        "standing feet: h + d, h_des + d, apex + d in the places of h, h_des, apex"),
    MILD_FIELD_CHOICE(RewardDef, gait_form, gait_names, TASK_GAITS,
                      "[-] gait: mean over feet of 1 or -0.3; sum, the paper's 1.3 (feet that "
                      "match, of two) - 0.3"),
    MILD_FIELD_CHOICE(RewardDef, acceleration_form, acceleration_names, TASK_ACCELERATIONS,
                      "[-] base_acceleration: change of the twist, m/s and rad/s; of the linear "
                      "velocity, the paper's v^b"),
};
const int reward_field_count = sizeof reward_fields / sizeof *reward_fields;

#define MODEL_NAME(id, name) #name,
static const char *const model_names[MILD_MODELS + 1] = {MILD_MODEL_LIST(MODEL_NAME) "own"};

#define Z(member, count, min, max, help) MILD_FIELD(RandomizeDef, member, D, count, min, max, help)
const MildField randomize_fields[] = {
    MILD_FIELD_CHOICE(RandomizeDef, model, model_names, MILD_MODELS + 1,
                      "[-] ground model, to which the grounds drawn are matched; own: that of the "
                      "preset, else mild_merged where recovery is at most 0.2 and mild elsewhere"),
    Z(rigid_share, 1, 0, 1, "[-] share of episodes on the engine's own rigid contact"),
    Z(rigid_time, 2, 0, 2,
      "[s] time constant of the rigid contact (MuJoCo's solref, damping ratio 1), low and high; "
      "0 0: the robot's own"),
    Z(preset_share, 1, 0, 1,
      "[-] share of episodes on a preset; the others draw their ground from the ranges below"),
    Z(preset_jitter, 1, 0, 0.9,
      "[-] each parameter of a preset is scaled by 1 plus or minus up to this"),
    MILD_FIELD(RandomizeDef, presets, MILD_FIELD_TEXT, TASK_TEXT_SIZE, 0, 0,
               "[text] what preset_share draws from: presets and files of soils (docs/soil.md), "
               "separated by commas; empty: all of mild and mild_merged"),
    Z(patch_share, 1, 0, 1, "[-] share of soft episodes whose ground changes in stripes"),
    Z(patch_length, 2, 0.1, 100, "[m] length of a stripe, low and high"),
    Z(k_pen, 2, 0, 1e6, "[N/m] penetration stiffness, low and high (paper)"),
    Z(sigma_cone, 2, 0, 1e8, "[N/m^3] depth-dependent conical stress, low and high (paper)"),
    Z(alpha, 2, 0.1, 1.5, "[rad] shear band angle, low and high (paper)"),
    Z(nu, 2, 0.05, 10, "[-] recruitment rate, low and high (paper)"),
    Z(c_g, 2, -10, 20, "[-] surrounding mass scale, low and high (paper)"),
    Z(c_d, 2, -50, 100, "[-] inertial drag scale, low and high (paper)"),
    Z(phi, 2, 0.1, 1, "[-] volume fraction, low and high (paper)"),
    Z(mu, 2, 0.01, 3, "[-] friction coefficient, low and high (paper)"),
    Z(rho, 2, 1, 5000, "[kg/m^3] grain density, low and high"),
    Z(k_drift, 2, 0, 1e6, "[N/m^2] drift stiffness k_D of an element, low and high"),
    Z(b_drift, 2, 0, 1e3, "[N s/m] drift damping b_D of an element, low and high"),
    Z(recovery, 2, 0, 1, "[-] share of the depth that springs back, low and high"),
    Z(bed_depth, 2, 0.001, 10, "[m] depth of the firm bed below the surface, low and high"),
    Z(slip_share, 1, 0, 1,
      "[-] share of the grounds of mild and mild_merged, recovery up to 0.2, on which slip "
      "costs as much support as drawn below; of the others a preset keeps its own"),
    Z(slip_length, 2, 1e-4, 1, "[m] of those: path over which slip halves it, low and high"),
    Z(grip, 2, 0, 1, "[-] of those: greatest friction by the virgin load, low and high"),
    MILD_FIELD(RandomizeDef, passive, B, 1, 0, 1,
               "[bool] c_g below 0 acts as 0 and c_d below 1/2 as 1/2, so that no ground creates "
               "energy; false: as drawn (paper)"),
    Z(sinkage_max, 1, 0.005, 1,
      "[m] softer grounds are made stiffer, so that one foot sinks at most this deep"),
    Z(shells_share, 1, 0, 1,
      "[-] share of episodes in which shells stand; the others are as with task.shells_stand = "
      "false"),
    Z(base_mass, 2, -8, 20, "[kg] mass added to the base, low and high (paper)"),
    Z(com_offset, 1, 0, 0.2,
      "[m] bound of the shift of the base's centre of mass (paper 0.006, vendor 0.06)"),
    Z(link_mass, 2, 0.1, 3, "[-] scale of each link's mass, low and high (vendor, narrower)"),
    Z(armature, 2, 0.1, 5, "[-] scale of the joints' armature, low and high (vendor, narrower)"),
    Z(motor_offset, 1, 0, 0.5, "[rad] bound of the offset of each joint's target angle (paper)"),
    Z(gain, 2, 0.1, 3, "[-] scale of kp and kd, low and high (vendor, narrower)"),
    Z(strength, 2, 0.1, 3, "[-] scale of the torque, low and high (vendor, narrower)"),
    Z(latency, 2, 0, 0.01,
      "[s] delay of the command, of motor readings and of IMU readings, low and high (paper)"),
    Z(scan_noise, 1, 0, 1, "[m] bound of the uniform noise of each height of the scan"),
    Z(scan_offset, 1, 0, 1, "[m] bound of the error of all its heights, drawn per episode"),
    Z(scan_delay, 2, 0, 0.2, "[s] from a scan to the policy, drawn per episode, low and high"),
    Z(scan_drop, 1, 0, 1, "[-] share of its numbers that read 0"),
    Z(push_interval, 1, 0, 1000, "[s] time between pushes; 0: no pushes (vendor)"),
    Z(push_linear, 1, 0, 5, "[m/s] bound of a push on each horizontal axis (vendor)"),
    Z(push_angular, 1, 0, 5, "[rad/s] bound of a push about each axis (vendor)"),
    Z(initial_joint, 1, 0, 0.5,
      "[rad] bound of the joints' distance from the default pose at the start"),
    Z(initial_velocity, 1, 0, 2, "[m/s] bound of the base's velocity at the start"),
};
const int randomize_field_count = sizeof randomize_fields / sizeof *randomize_fields;

/* Checks every pair of numbers in these tables, which are ranges. */
static MildStatus check_section(const MildField *fields, int count, const void *def,
                                const char *section, MildError *error) {
    MildStatus status = mild_fields_check(fields, count, def, section, error);
    for (int i = 0; status == MILD_OK && i < count; i++) {
        const double *range = (const double *)(const void *)((const char *)def + fields[i].offset);
        if (fields[i].type == MILD_FIELD_DOUBLE && fields[i].count == 2 && range[0] > range[1]) {
            status = mild_fail(error, MILD_ERROR_RANGE, "%s.%s: low %g is above high %g", section,
                               fields[i].name, range[0], range[1]);
        }
    }
    return status;
}

/* A key whose text has numbers for the joints. */
typedef struct {
    const char *key, *text;
    double least, most;
    const double *own; /* [joints] what the word robot stands for; NULL: nothing */
    double *numbers;   /* [joints] out */
} JointList;

/* Reads the numbers of a list. Returns their number, or -1 with a message. */
static int read_numbers(const JointList *list, double *number, MildError *error) {
    int count = 0;
    for (const char *at = list->text + strspn(list->text, " ,\t"); *at; at += strspn(at, " ,\t")) {
        char *end = NULL;
        double value = strtod(at, &end);
        if (end == at || !(value >= list->least && value <= list->most) ||
            count == ROBOT_JOINTS_MAX) {
            mild_fail(error, MILD_ERROR_RANGE, "task.%s = %.60s: %sup to %d numbers from %g to %g",
                      list->key, list->text, list->own ? "neither robot nor " : "not ",
                      ROBOT_JOINTS_MAX, list->least, list->most);
            return -1;
        }
        number[count++] = value;
        at = end;
    }
    return count;
}

/* joints 0: of any robot. */
static MildStatus take_list(const JointList *list, int joints, MildError *error) {
    double number[ROBOT_JOINTS_MAX];
    if (list->own && strcmp(list->text, "robot") == 0) {
        memcpy(list->numbers, list->own, (size_t)joints * sizeof *number);
        return MILD_OK;
    }
    int count = read_numbers(list, number, error);
    if (count < 0) {
        return MILD_ERROR_RANGE;
    }
    if (count == 0 || joints % count != 0) {
        return mild_fail(
            error, MILD_ERROR_RANGE, "task.%s = %.60s: %d numbers do not fit %d joints%s",
            list->key, list->text, count, joints, list->own ? "; robot takes the robot's own" : "");
    }
    for (int i = 0; i < joints; i++) {
        list->numbers[i] = number[i % count];
    }
    return MILD_OK;
}

/* joints 0, own NULL: of any robot. */
static MildStatus take_gains(const TaskDef *def, int joints, const double *kp, const double *kd,
                             TaskGains *gains, MildError *error) {
    const JointList lists[] = {{"kp", def->kp, 0, KP_MAX, kp, gains->kp},
                               {"kd", def->kd, 0, KD_MAX, kd, gains->kd},
                               {"torque_share", def->torque_share, 0.1, 1, NULL, gains->limit}};
    MildStatus status = MILD_OK;
    memset(gains, 0, sizeof *gains);
    for (size_t i = 0; status == MILD_OK && i < sizeof lists / sizeof *lists; i++) {
        status = take_list(&lists[i], joints, error);
    }
    return status;
}

MildStatus task_gains(const TaskDef *def, const Robot *robot, TaskGains *gains, MildError *error) {
    const int joints = robot_joints(robot);
    MildStatus status = take_gains(def, joints, robot_kp(robot), robot_kd(robot), gains, error);
    for (int i = 0; i < joints; i++) {
        gains->limit[i] *= robot_effort(robot)[i];
    }
    return status;
}

MildStatus task_def_check_robot(const TaskDef *def, const Robot *robot, MildError *error) {
    TaskGains gains;
    MildStatus status = task_def_check(def, error);
    if (status == MILD_OK && def->randomize.presets[0] && !def->soils) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "randomize.presets = %.100s: nothing draws grounds here; leave it out",
                         def->randomize.presets);
    }
    if (status == MILD_OK && def->actuator[0] && !def->motors) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "task.actuator = %.100s: there is no actuator network here; leave it out",
                         def->actuator);
    }
    return status == MILD_OK ? task_gains(def, robot, &gains, error) : status;
}

MildStatus task_set_robot(const TaskDef *def, Robot *robot, MildError *error) {
    MildError cause = {0};
    robot_set_gait(robot, def->gait ? gait_offsets[def->gait] : NULL);
    const MildStatus status = robot_set_elements(robot, def->sole_elements, &cause);
    return status == MILD_OK ? MILD_OK
                             : mild_fail(error, status, "task.sole_elements = %d: %s",
                                         def->sole_elements, cause.text);
}

MildStatus task_def_check_plain(const TaskDef *def, const char *what, MildError *error) {
    if (def->jump[1] > 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s: the policy was trained to jump (task.jump); train, eval and play "
                         "command jumps",
                         what);
    }
    return def->scan > 0 ? mild_fail(error, MILD_ERROR_ARGUMENT,
                                     "%s: the policy sees the ground (task.scan), as it does in "
                                     "train, eval and play",
                                     what)
                         : MILD_OK;
}

/* Of a task that has one. */
static MildStatus check_scan(const TaskDef *def, MildError *error) {
    const int points = task_scan_rows(def) * task_scan_columns(def);
    return def->scan == 0 || points <= TASK_SCAN_MAX
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "task.scan: %d rows of %d points are more than %d; give a larger "
                           "task.scan_pitch",
                           task_scan_rows(def), task_scan_columns(def), TASK_SCAN_MAX);
}

MildStatus task_def_check(const TaskDef *def, MildError *error) {
    MildStatus status = check_section(task_fields, task_field_count, def, "task", error);
    if (status == MILD_OK) {
        status = check_section(reward_fields, reward_field_count, &def->reward, "reward", error);
    }
    if (status == MILD_OK) {
        status = check_section(randomize_fields, randomize_field_count, &def->randomize,
                               "randomize", error);
    }
    TaskGains gains;
    const double any[ROBOT_JOINTS_MAX] = {0};
    status = status == MILD_OK ? take_gains(def, 0, any, any, &gains, error) : status;
    double steps = TASK_PERIOD / def->physics_dt;
    if (status == MILD_OK && !(fabs(steps - floor(steps + 0.5)) < 1e-9)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "task.physics_dt: %g s is not a whole multiple of %g", TASK_PERIOD,
                         def->physics_dt);
    }
    status = status == MILD_OK ? check_scan(def, error) : status;
    if (status == MILD_OK && def->contact_float &&
        (def->solver != MILD_SOLVER_NEWTON || def->contact_tolerance < FLOAT_GROUND_TOLERANCE)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "task.contact_float: float converges to a residual of %g, by newton; give "
                         "task.solver = newton and task.contact_tolerance = %g or more",
                         FLOAT_GROUND_TOLERANCE, FLOAT_GROUND_TOLERANCE);
    }
    if (status == MILD_OK && !def->shells_stand &&
        (def->may_lie || def->start != TASK_START_STAND)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "task.%s: a robot lies on its shells; give "
                         "task.shells_stand = true",
                         def->may_lie ? "may_lie" : "start");
    }
    if (status == MILD_OK && def->randomize.rigid_share + def->randomize.preset_share > 1 + 1e-12) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "randomize: rigid_share + preset_share is above 1");
    }
    return status;
}
