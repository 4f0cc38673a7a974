/* A legged robot in MuJoCo whose feet stand on our ground. A Robot is the constant description,
 * read from a folder (docs/robots.md). A RobotSim is the workspace of one thread. A RobotState is
 * the persistent state of one robot, without pointers. Joints and feet are numbered in the order of
 * robot.ini. */
#ifndef MILD_ROBOT_H
#define MILD_ROBOT_H

#include "mild/ground.h"
#include "robot/limits.h"
#include "robot/table.h"

/* What a simulation of a robot reads and writes: plain numbers without pointers. Joints and feet
 * are numbered in the order of robot.ini. */

/* Persistent state. Entries beyond the robot's joints are 0. */
typedef struct {
    double qpos[ROBOT_NQ_MAX]; /* [m, -, rad] base x y z, quaternion w x y z, joints */
    /* [m/s, rad/s] Base linear velocity (world axes), angular velocity (base axes), joints. */
    double qvel[ROBOT_NV_MAX];
    double qacc[ROBOT_NV_MAX]; /* [m/s^2, rad/s^2] of the last step: which joint limits push in the
                                  next one, and where its solver starts */
} RobotState;

/* What differs from robot to robot (domain randomisation). */
typedef struct {
    double base_mass_add; /* [kg] added to the base */
    double com_offset[3]; /* [m] shift of the base's centre of mass */
    /* [-] Scale of mass and inertia: of the base, then of the body of each joint. */
    double link_mass_scale[1 + ROBOT_JOINTS_MAX];
    double armature_scale; /* [-] of the joints' armature */
    double rigid_friction; /* [-] friction coefficient of the engine's contact when rigid */
    double rigid_time; /* [s] time constant of that contact, critically damped; 0: the model's */
    int rigid;         /* bool: the engine's own contact under the feet's corners, no soft ground */
    int shells_stand;  /* bool: the ground pushes against shells, see robot_set_shells */
} RobotVariation;

/* State of a foot after a step, in world axes about its reference point. The reference point is the
 * origin of a flat foot's body, or the lowest point of a round foot. A round foot transmits no
 * moment, so its rotation is the identity, and its torque and angular velocity are 0. */
typedef struct {
    double position[3];             /* [m] reference point */
    double rotation[9];             /* [-] foot to world, row major */
    double velocity[6];             /* [m/s, rad/s] twist at the reference point */
    double force[3];                /* [N] of the ground on the foot, mean over the step */
    double torque[3];               /* [N m] about the reference point */
    double sole_height;             /* [m] lowest sole point above h0 (above z = 0 after
                                       robot_sim_load), negative when sunk */
    double sole_center[3];          /* [m] centre of the sole */
    double sole_center_velocity[3]; /* [m/s] */
    MildFootResult result;
} RobotFoot;

typedef struct Robot Robot;
typedef struct RobotSim RobotSim;
struct mjModel_; /* MuJoCo's mjModel and mjData, for who includes mujoco.h */
struct mjData_;

RobotVariation robot_variation_nominal(void);

/* Reads folder/robot.ini and the MJCF that it names. Returns NULL when something is missing or
 * inconsistent, with one line in *error that names file, section, key and remedy. */
Robot *robot_create(const char *folder, MildError *error);
/* The same by name: a folder of robots/, for example sa01, or any folder if the name contains a
 * slash. */
Robot *robot_open(const char *name, MildError *error);
enum { ROBOT_LISTED_MAX = 64, ROBOT_LISTED_SIZE = 64 };
/* Writes the sorted names of the folders under robots/, at most `most`. Returns their number. */
int robot_list(char names[][ROBOT_LISTED_SIZE], int most);
/* File in `path` [PATH_SIZE] of the policy that ships for a robot's name: that of the name in
 * policies/, or that of SA01. name: NULL: none is given. */
const char *robot_policy(const char *name, char *path);
void robot_destroy(Robot *robot); /* may be NULL */

/* ---- constants from the folder ---- */
const char *robot_name(const Robot *robot);
const char *robot_source(const Robot *robot);     /* whose numbers, which licence */
const char *robot_model_path(const Robot *robot); /* MJCF */
int robot_joints(const Robot *robot);
/* Joints that a policy acts on: the first of them. The others are driven: another program, or
 * env/task/driven.h in its place, moves them. */
int robot_actions(const Robot *robot);
int robot_feet(const Robot *robot);
int robot_points(const Robot *robot); /* bool: no foot transmits a moment to soft ground */
const char *robot_joint_name(const Robot *robot, int joint);
const char *robot_foot_name(const Robot *robot, int foot);
double robot_total_mass(const Robot *robot);     /* [kg] */
double robot_foot_load(const Robot *robot);      /* [N] weight divided by the number of feet */
double robot_stand_height(const Robot *robot);   /* [m] base above the soles in the default pose */
double robot_nominal_height(const Robot *robot); /* [m] wanted base height while walking */
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
const double *robot_swing(const Robot *robot);     /* [-] amplitude in the reference swing motion */
const int *robot_joint_foot(const Robot *robot);   /* the only foot that it moves, or -1 */
const int *robot_joint_dof(const Robot *robot);    /* in the engine: qvel[dof], qpos[dof + 1] */
int robot_foot_body(const Robot *robot, int foot); /* of the sims' model */
int robot_ankle(const Robot *robot, int foot);     /* joint that pitches a flat sole, or -1 */
/* The robot's mirror image in the x-z plane: q'_i = sign_i q_mirror_i. */
const int *robot_mirror_joint(const Robot *robot);
const double *robot_mirror_sign(const Robot *robot);
/* [-] Share of the gait cycle between a gait and its mirror image: 0.5 when sides alternate, 0 when
 * they move together, -1 when it has none. */
double robot_mirror_shift(const Robot *robot);
/* What a task needs, as one block without pointers. */
const RobotTable *robot_table(const Robot *robot);

/* [robot_bodies] The soles in use, see robot_set_model, robot_set_elements and robot_set_shells: of
 * the feet, then of the bodies with shells. */
const MildSole *const *robot_soles(const Robot *robot);
/* Number of bodies that stand: the feet, and with robot_set_shells those with shells. A concentric
 * model has none for these. */
int robot_bodies(const Robot *robot);
/* [robot_feet] The rasterised outlines, regardless of robot_set_model and robot_set_elements. */
const MildSole *const *robot_rasters(const Robot *robot);
/* Gives the feet the soles of a ground model: a single element for concentric models, otherwise the
 * rasters (the default). Call it before making sims and ground memory. */
void robot_set_model(Robot *robot, MildModel model);
/* Gives each foot a coarser raster, of that many elements: with the area, the centroid and the
 * second moments of area of its own (docs/model.md section 16). 0: its own (the default). Fails,
 * with the soles unchanged, for more than a foot has, for so few that they lie on a line, for a
 * round foot, and after robot_set_model of a concentric model. Call it before making sims and
 * ground memory. */
MildStatus robot_set_elements(Robot *robot, int elements, MildError *error);
/* Lets the stance of foot f begin at offset[f % 4] of the gait cycle; NULL: where robot.ini says
 * so. */
void robot_set_gait(Robot *robot, const double *offset);
/* Lets the shells stand too (stand: bool; at first they do not). Call it when
 * robot_set_model may be called. */
void robot_set_shells(Robot *robot, int stand);
/* mild_model_match for this robot: the first foot's raster under robot_foot_load. */
MildStatus robot_match_model(const Robot *robot, MildModel model, const MildMaterial *from,
                             MildMaterial *rival, MildError *error);
/* The whole file with its shapes, cameras and lights, for pictures. The sims' own model has only
 * what a step needs. */
const struct mjModel_ *robot_visual_model(const Robot *robot);
/* Converts the qpos of a state to the engine's order, for the mjData of either model. */
void robot_engine_qpos(const Robot *robot, const double *qpos, double *engine);
/* The same of its qvel or qacc. */
void robot_engine_rates(const Robot *robot, const double *rates, double *engine);

/* One per thread. dt: physics step [s], 0.0001 .. 0.01. */
RobotSim *robot_sim_create(const Robot *robot, double dt, MildError *error);
void robot_sim_destroy(RobotSim *sim);
/* tolerance: relative; iterations: upper limit. 0 means the solver's default. */
void robot_sim_set_solver(RobotSim *sim, MildSolver solver, double tolerance, int iterations);
double robot_sim_dt(const RobotSim *sim);

/* Applies the variation to the workspace's own model (cheap when unchanged) and loads the state.
 * Kinematics and foot twists are valid afterwards. */
void robot_sim_load(RobotSim *sim, const RobotState *state, const RobotVariation *variation);
void robot_sim_store(const RobotSim *sim, RobotState *state);
/* One physics step under joint torques [robot_joints] on the terrain. push: NULL, or [6] force and
 * torque on the base, world. Returns 0, or 1 when the simulation diverged (NaN or |qvel| > 1e3).
 * The state is then unusable until robot_sim_load. */
int robot_sim_step(RobotSim *sim, const double *torque, const double *push,
                   const MildTerrain *terrain, MildGround *ground);

/* Who computes the wrenches of soft ground on the feet in the place of libmild: another ground, or
 * libmild's own in float (float_ground.h). */
typedef struct {
    /* Writes force, torque and depths of each foot, means over the step, to *result, which is 0.
     * `ground` is the memory that robot_sim_step was given, and may be advanced. Returns 0, or 1
     * when it cannot: the step has then diverged. */
    int (*solve)(void *self, const MildTerrain *terrain, MildGround *ground,
                 const MildContactInput *input, MildContactResult *result);
    void *self;
} RobotGround;
/* From now on; NULL: libmild again. Shells do not feel another ground. *ground is borrowed. */
void robot_sim_set_ground(RobotSim *sim, const RobotGround *ground);

/* Time in each phase of a physics step, and steps, summed while attached to a workspace. */
typedef struct {
    double smooth; /* [s] mass matrix, factor, bias, smooth acceleration */
    double map;    /* [s] A = J M^-1 J^T and the free twist */
    double ground; /* [s] mild_ground_solve and mild_ground_advance, or the engine's collision when
                      rigid */
    double finish; /* [s] wrench, joint limits or engine contact solver, integration, next pose */
    long steps;
} RobotPhases;

/* phases: NULL stops the timing. */
void robot_sim_time_phases(RobotSim *sim, RobotPhases *phases);

/* Valid after load or step, in the order of RobotState. */
const double *robot_sim_qpos(const RobotSim *sim);
const double *robot_sim_qvel(const RobotSim *sim);
const double *robot_sim_base_rotation(const RobotSim *sim); /* [9] base to world, row major */
/* [3] m: centre of mass of the robot, world */
const double *robot_sim_mass_center(const RobotSim *sim);
const RobotFoot *robot_sim_foot(const RobotSim *sim, int foot);
/* [m] Height of the lowest point of all soles above the terrain under it. Also updates the feet's
 * sole_height for this terrain. */
double robot_sim_sole_clearance(RobotSim *sim, const MildTerrain *terrain);
/* [m] Height of the lowest point of the shells above the undisturbed ground; negative when a shell
 * touches it. */
double robot_sim_body_clearance(const RobotSim *sim, const MildTerrain *terrain);
/* [m] The same of the shells of the base and of bodies welded to it; 1e9 without any. */
double robot_sim_base_clearance(const RobotSim *sim, const MildTerrain *terrain);
/* [m] Smallest lateral distance between mirrored knees, and between mirrored sole centres, in the
 * base's heading frame. Negative when the legs are crossed; 1e9 without such a pair. */
double robot_sim_knee_distance(const RobotSim *sim);
double robot_sim_foot_distance(const RobotSim *sim);
/* [m] Least distance of two legs, between the capsules of [robot] legs; negative: overlap. 1e9
 * without two legs. */
double robot_sim_leg_distance(const RobotSim *sim);
/* [N] Vertical force of the ground on the shells, mean over the last step. */
double robot_sim_shell_load(const RobotSim *sim);
const MildScratch *robot_sim_scratch(const RobotSim *sim);
/* mild_ground_change for the ground that robot_sim_step is given. */
void robot_sim_change_ground(RobotSim *sim, const MildTerrain *from, const MildTerrain *to,
                             MildGround *ground);
const MildContactResult *robot_sim_contact(const RobotSim *sim);
/* Input of the last step on soft ground. */
const MildContactInput *robot_sim_contact_input(const RobotSim *sim);
/* The engine's objects of this workspace; pictures use robot_visual_model. */
struct mjModel_ *robot_sim_model(RobotSim *sim);
struct mjData_ *robot_sim_data(RobotSim *sim);

#endif
