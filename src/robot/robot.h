/* A biped in MuJoCo whose feet stand on our ground. Robot: constant description. RobotSim: one
 * thread's workspace. RobotState: what persists of one robot, a pointer-free block. */
#ifndef MILD_ROBOT_H
#define MILD_ROBOT_H

#include "mild/ground.h"

#define ROBOT_JOINTS 12
#define ROBOT_NQ 19
#define ROBOT_NV 18
#define ROBOT_FEET 2
#define ROBOT_FOOT_LEFT 0
#define ROBOT_FOOT_RIGHT 1

typedef struct Robot Robot;
typedef struct RobotSim RobotSim;

/* Persists. qpos: base x y z, quaternion w x y z, 12 joints (left then right: roll yaw pitch knee
 * ankle-pitch ankle-roll). qvel: base linear (world axes), base angular (base axes), joints. */
typedef struct {
    double qpos[ROBOT_NQ];
    double qvel[ROBOT_NV];
    double warmstart[ROBOT_NV]; /* engine's qacc_warmstart */
} RobotState;

/* What differs from robot to robot (domain randomisation). */
typedef struct {
    double base_mass_add; /* [kg] */
    double com_offset[3]; /* [m] of the base's centre of mass */
    double link_mass_scale[ROBOT_JOINTS +
                           1]; /* [-] base, then links in joint order; scales mass and inertia */
    double armature_scale;     /* [-] */
    double rigid_friction;     /* [-] of the engine's contact when rigid */
    int rigid; /* bool: the engine's own contact under the feet (8 sole corners), no soft ground */
} RobotVariation;
RobotVariation robot_variation_nominal(void);

/* Everything one sees of a foot after a step. World axes, twist at the ankle. */
typedef struct {
    double position[3], rotation[9], velocity[6];
    double force[3],
        torque[3];      /* [N, N m] of the ground on the foot, at the ankle, mean over the step */
    double sole_height; /* [m] lowest sole point above h0 (above z = 0 after a load), negative when
                           sunk */
    double sole_center[3];          /* [m] centre of the sole, world */
    double sole_center_velocity[3]; /* [m/s] */
    MildFootResult result;
} RobotFoot;

/* Loads models/sa01/sa01.xml (or another MJCF with the same names); names the missing foot or
 * joint. */
Robot *robot_create(const char *xml_path, MildError *error);
void robot_destroy(Robot *robot);
const MildSole *const *
robot_soles(const Robot *robot); /* [ROBOT_FEET] that the feet have: see robot_set_model */
const MildSole *const *
robot_rasters(const Robot *robot); /* [ROBOT_FEET] of the outlines, whatever the model */
/* Gives the feet the soles of a ground model: one element in the middle for the concentric ones,
 * the rasters otherwise (the default). Before sims and ground memory are made. */
void robot_set_model(Robot *robot, MildModel model);
/* mild_model_match for this robot: one raster sole under half the robot's weight. */
MildStatus robot_match_model(const Robot *robot, MildModel model, const MildMaterial *mild,
                             MildMaterial *rival, MildError *error);
double robot_total_mass(const Robot *robot);
double robot_half_weight(const Robot *robot);  /* [N] */
double robot_stand_height(const Robot *robot); /* [m] base above the sole in the default pose */
const double *robot_default_pose(const Robot *robot); /* [ROBOT_JOINTS] rad */
const double *robot_joint_low(const Robot *robot);    /* [ROBOT_JOINTS] rad */
const double *robot_joint_high(const Robot *robot);
const double *robot_effort(const Robot *robot); /* [ROBOT_JOINTS] N m */
/* const mjModel * of the whole file with its shapes, cameras and lights, for pictures: same qpos;
 * the sims' own model has only what a step needs. */
const void *robot_visual_model(const Robot *robot);

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
/* One physics step under joint torques [ROBOT_JOINTS] on the terrain. push: NULL or [6] force,
 * torque on the base, world. Returns 0, or 1 when a number went bad (NaN or |qvel| > 1e3; the state
 * is then unusable: reload). */
int robot_sim_step(RobotSim *sim, const double *torque, const double *push,
                   const MildTerrain *terrain, MildGround *ground);

/* Valid after load or step; qvel and qpos are the sim's own (read them, write only through load).
 */
const double *robot_sim_qpos(const RobotSim *sim);
const double *robot_sim_qvel(const RobotSim *sim);
const double *robot_sim_base_rotation(const RobotSim *sim); /* [9] base -> world, row major */
const RobotFoot *robot_sim_foot(const RobotSim *sim, int foot);
/* [m] Lowest point of both soles above the terrain under it; the feet's sole_height is taken above
 * this terrain too. */
double robot_sim_sole_clearance(RobotSim *sim, const MildTerrain *terrain);
/* Kinematic contact test against the undisturbed ground: lowest point of the base box and of each
 * shank [m]; < 0 touches. */
double robot_sim_body_clearance(const RobotSim *sim, const MildTerrain *terrain);
/* Distance between the two knees and between the two sole centres, lateral in the base's heading
 * frame [m]. */
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
