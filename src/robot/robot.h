/* A legged robot in MuJoCo whose feet stand on our ground. Robot: constant description, read from a
 * folder (docs/robots.md). RobotSim: one thread's workspace. RobotState: what persists of one
 * robot, a pointer-free block. Joints and feet are counted in the order of robot.ini. */
#ifndef MILD_ROBOT_H
#define MILD_ROBOT_H

#include "mild/ground.h"
#include "robot/limits.h"

typedef struct Robot Robot;
typedef struct RobotSim RobotSim;

/* Persists; what is beyond the robot's joints is 0. */
typedef struct {
    double qpos[ROBOT_NQ_MAX]; /* [m, -, rad] base x y z, quaternion w x y z, joints */
    double
        qvel[ROBOT_NV_MAX]; /* [m/s, rad/s] base linear (world axes), angular (base axes), joints */
    double warmstart[ROBOT_NV_MAX]; /* the engine's qacc_warmstart, in its own order */
} RobotState;

/* What differs from robot to robot (domain randomisation). */
typedef struct {
    double base_mass_add; /* [kg] */
    double com_offset[3]; /* [m] of the base's centre of mass */
    double
        link_mass_scale[1 + ROBOT_JOINTS_MAX]; /* [-] of mass and inertia: base, joints' bodies */
    double armature_scale;                     /* [-] */
    double rigid_friction;                     /* [-] of the engine's contact when rigid */
    int rigid; /* bool: the engine's own contact under the feet's corners, no soft ground */
} RobotVariation;
RobotVariation robot_variation_nominal(void);

/* Everything one sees of a foot after a step, in world axes about its reference point: the origin
 * of a flat foot's body, the lowest point of a round foot. A round foot transmits no moment: its
 * rotation is the identity, and torque and angular velocity are 0. */
typedef struct {
    double position[3];             /* [m] reference point */
    double rotation[9];             /* [-] foot -> world, row major */
    double velocity[6];             /* [m/s, rad/s] twist of the foot there */
    double force[3];                /* [N] of the ground on the foot, mean over the step */
    double torque[3];               /* [N m] about the reference point */
    double sole_height;             /* [m] lowest sole point above h0 (above z = 0 after a load),
                                       negative when sunk */
    double sole_center[3];          /* [m] centre of the sole */
    double sole_center_velocity[3]; /* [m/s] */
    MildFootResult result;
} RobotFoot;

/* Reads folder/robot.ini and the MJCF that it names. NULL, with one line that names file, section,
 * key and remedy, when something is missing or inconsistent. */
Robot *robot_create(const char *folder, MildError *error);
/* The same for a folder of robots/ by its name, e.g. sa01; with a slash it is any folder. */
Robot *robot_open(const char *name, MildError *error);
enum { ROBOT_LISTED_MAX = 64, ROBOT_LISTED_SIZE = 64 };
/* Names of the folders under robots/, sorted; returns how many, at most `most`. */
int robot_list(char names[][ROBOT_LISTED_SIZE], int most);
void robot_destroy(Robot *robot); /* may be NULL */

/* ---- what the folder says; constant ---- */
const char *robot_name(const Robot *robot);
const char *robot_source(const Robot *robot);     /* whose numbers, which licence */
const char *robot_model_path(const Robot *robot); /* MJCF */
int robot_joints(const Robot *robot);
int robot_feet(const Robot *robot);
const char *robot_joint_name(const Robot *robot, int joint);
const char *robot_foot_name(const Robot *robot, int foot);
double robot_total_mass(const Robot *robot);     /* [kg] */
double robot_foot_load(const Robot *robot);      /* [N] weight divided by the number of feet */
double robot_stand_height(const Robot *robot);   /* [m] base above the soles in the default pose */
double robot_nominal_height(const Robot *robot); /* [m] that a walk wants */
double robot_action_scale(const Robot *robot);   /* [rad] joint offset per unit of action */
double robot_foot_force(const Robot *robot);     /* [N] above which a landing is hard */
/* One number per joint, [robot_joints]. */
const double *robot_default_pose(const Robot *robot); /* [rad] */
const double *robot_joint_low(const Robot *robot);    /* [rad] */
const double *robot_joint_high(const Robot *robot);   /* [rad] */
const double *robot_effort(const Robot *robot);       /* [N m] */
const double *robot_speed(const Robot *robot);        /* [rad/s] limit of the motor, 0: none */
const double *robot_kp(const Robot *robot);           /* [N m/rad] */
const double *robot_kd(const Robot *robot);           /* [N m s/rad] */
const double *robot_stand_kp(const Robot *robot);     /* [N m/rad] of the controller `stand` */
const double *robot_stand_kd(const Robot *robot);     /* [N m s/rad] */
const double *robot_swing(const Robot *robot);     /* [-] bend of a swing leg's reference motion */
const double *robot_still(const Robot *robot);     /* [-] 1: stays near the default pose */
const int *robot_joint_foot(const Robot *robot);   /* foot that alone moves with it, or -1 */
const int *robot_joint_dof(const Robot *robot);    /* in the engine: qvel[dof], qpos[dof + 1] */
int robot_foot_body(const Robot *robot, int foot); /* of the sims' model */
int robot_ankle(const Robot *robot, int foot);     /* joint that pitches a flat sole, or -1 */
/* The robot's mirror image in the x-z plane: q'_i = sign_i q_mirror_i. */
const int *robot_mirror_joint(const Robot *robot);
const double *robot_mirror_sign(const Robot *robot);
int robot_mirror_foot(const Robot *robot, int foot);
double robot_mirror_shift(const Robot *robot); /* [-] of the gait cycle: 0.5 when sides alternate */
/* [-] in [0, 1): share of the gait cycle at which the foot's stance begins. */
double robot_gait_offset(const Robot *robot, int foot);
/* [m] Limits [2] of the lateral distance of mirrored feet and knees, and the distance below which
 * they collide. */
const double *robot_feet_range(const Robot *robot);
const double *robot_knee_range(const Robot *robot);
double robot_feet_least(const Robot *robot);
double robot_knee_least(const Robot *robot);
/* [4] Helping hand of a beginner: [N m/rad] and [N m s/rad] against tilt, [N s/m] towards the
 * commanded velocity, [N] at most. */
const double *robot_assist(const Robot *robot);

/* [robot_feet] that the feet have: see robot_set_model */
const MildSole *const *robot_soles(const Robot *robot);
/* [robot_feet] of the outlines, whatever the model */
const MildSole *const *robot_rasters(const Robot *robot);
/* Gives the feet the soles of a ground model: one element in the middle for the concentric ones,
 * the rasters otherwise (the default). Before sims and ground memory are made. */
void robot_set_model(Robot *robot, MildModel model);
/* mild_model_match for this robot: the first foot's raster under robot_foot_load. */
MildStatus robot_match_model(const Robot *robot, MildModel model, const MildMaterial *mild,
                             MildMaterial *rival, MildError *error);
/* const mjModel * of the whole file with its shapes, cameras and lights, for pictures; the sims'
 * own model has only what a step needs. */
const void *robot_visual_model(const Robot *robot);
/* qpos of a state in the engine's order, for mjData of either model. */
void robot_engine_qpos(const Robot *robot, const double *qpos, double *engine);

/* One per thread. dt: physics step [s], 0.0001 .. 0.01. */
RobotSim *robot_sim_create(const Robot *robot, double dt, MildError *error);
void robot_sim_destroy(RobotSim *sim);
/* tolerance: relative, 0 = the solver's default; iterations: hard bound, 0 = the solver's default.
 */
void robot_sim_set_solver(RobotSim *sim, MildSolver solver, double tolerance, int iterations);
double robot_sim_dt(const RobotSim *sim);

/* Applies the variation to the workspace's own model (cheap when unchanged) and loads the state;
 * kinematics and foot twists are valid afterwards. */
void robot_sim_load(RobotSim *sim, const RobotState *state, const RobotVariation *variation);
void robot_sim_store(const RobotSim *sim, RobotState *state);
/* One physics step under joint torques [robot_joints] on the terrain. push: NULL or [6] force,
 * torque on the base, world. Returns 0, or 1 when a number went bad (NaN or |qvel| > 1e3; the state
 * is then unusable: reload). */
int robot_sim_step(RobotSim *sim, const double *torque, const double *push,
                   const MildTerrain *terrain, MildGround *ground);

/* Valid after load or step, in the order of RobotState. */
const double *robot_sim_qpos(const RobotSim *sim);
const double *robot_sim_qvel(const RobotSim *sim);
const double *robot_sim_base_rotation(const RobotSim *sim); /* [9] base -> world, row major */
const RobotFoot *robot_sim_foot(const RobotSim *sim, int foot);
/* [m] Lowest point of all soles above the terrain under it; the feet's sole_height is taken above
 * this terrain too. */
double robot_sim_sole_clearance(RobotSim *sim, const MildTerrain *terrain);
/* Kinematic contact test against the undisturbed ground: lowest point of the shells [m]; < 0
 * touches. */
double robot_sim_body_clearance(const RobotSim *sim, const MildTerrain *terrain);
/* [m] Least distance between mirrored knees and between mirrored sole centres, lateral in the
 * base's heading frame, negative when the legs are crossed; 1e9 without such a pair. */
double robot_sim_knee_distance(const RobotSim *sim);
double robot_sim_foot_distance(const RobotSim *sim);
const MildScratch *robot_sim_scratch(const RobotSim *sim);
const MildContactResult *robot_sim_contact(const RobotSim *sim);
const MildContactInput *
robot_sim_contact_input(const RobotSim *sim); /* of the last step on soft ground */
/* The engine's objects of this workspace, for tests (mjModel *, mjData *); pictures use
 * robot_visual_model. */
void *robot_sim_model(RobotSim *sim);
void *robot_sim_data(RobotSim *sim);

#endif
