/* Private to the layers robot and engine: the contents of a Robot, from robot.ini and the compiled
 * MJCF. */
#ifndef ROBOT_DESCRIPTION_H
#define ROBOT_DESCRIPTION_H

#include <mujoco/mujoco.h>

#include "robot/def.h"
#include "robot/table.h"

#define ROBOT_FOOT_DOFS_MAX ROBOT_NV_MAX /* base six, then the hinges between base and foot */
#define ROBOT_PATH_SIZE 1024
#define ROBOT_BODIES_MAX MILD_FEET_MAX /* feet, and bodies of shells */

/* A foot in the model, or a body with shells: then `body`, `dofs`, `dof` and `shared` alone are
 * set. */
typedef struct {
    int body;
    int knee_body;
    int mirror;                   /* foot on the other side */
    int ankle;                    /* joint that pitches a flat sole, or -1 */
    int round;                    /* bool: a sphere that transmits no moment */
    double sole_center[3];        /* [m] flat: middle of the outline's bounds, body frame */
    int dofs;                     /* degrees of freedom that move the foot, base six first */
    int dof[ROBOT_FOOT_DOFS_MAX]; /* [dofs] ascending */
    int shared[ROBOT_BODIES_MAX]; /* how many of the leading ones also move the other body */
} RobotLimb;

/* A part of a body that meets the ground: a box inflated by a radius. Spheres and capsules are
 * inflated boxes of zero width; a mesh has the box around it. */
typedef struct {
    int body;
    int limb;           /* number of the body in Robot.limb */
    int floor_geom;     /* of the body in Robot.model, for contacts with rigid ground */
    int on_base;        /* bool: of the base, or of a body welded to it */
    double center[3];   /* [m] body frame */
    double rotation[9]; /* [-] box -> body, row major */
    double half[3];     /* [m] */
    double radius;      /* [m] */
    MildShape mesh;     /* its own vertices, and triangles of Robot.visual; without any no mesh */
    double *vertices;   /* of the mesh */
} RobotShell;

/* A part of a leg that touches other legs (robot/legs.h). */
typedef struct {
    int body;
    int foot;         /* of its leg */
    double center[3]; /* [m] body frame */
    double half[3];   /* [m] from the centre to the end of the axis */
    double radius;    /* [m] */
} RobotCapsule;

typedef struct Robot {
    RobotDef def;
    char path[ROBOT_PATH_SIZE];           /* of the MJCF */
    mjModel *model;                       /* bodies, joints, floor and corners: what a step needs */
    mjModel *visual;                      /* the whole file, for pictures */
    MildSole *rasters[ROBOT_FEET_MAX];    /* by the pitch and the elements of robot.ini */
    MildSole *soles[ROBOT_BODIES_MAX];    /* the rasters, or coarser ones (raster.c); then of
                                             each body the one of its shells */
    MildSole *concentric[ROBOT_FEET_MAX]; /* one element in the middle of each */
    int is_concentric;                    /* bool: the feet use `concentric`, not `soles` */
    int nq;                               /* 7 + joints */
    int nv;                               /* 6 + joints */
    int base_body;
    int floor_geom;
    RobotLimb limb[ROBOT_BODIES_MAX];
    int shell_bodies;                /* limbs behind the feet */
    int shells_stand;                /* bool: they stand */
    int pairs;                       /* of mirrored feet */
    int pair[ROBOT_FEET_MAX / 2][2]; /* left foot, right foot */
    int dof[ROBOT_JOINTS_MAX];       /* of joint i in the engine: qvel[dof], qpos[dof + 1] */
    int mirror_joint[ROBOT_JOINTS_MAX];
    int joint_foot[ROBOT_JOINTS_MAX]; /* the only foot that the joint moves, or -1 */
    double low[ROBOT_JOINTS_MAX];     /* [rad] */
    double high[ROBOT_JOINTS_MAX];    /* [rad] */
    double effort[ROBOT_JOINTS_MAX];  /* [N m] */
    int shells;
    RobotShell shell[ROBOT_SHELLS_MAX];
    int capsules;
    RobotCapsule capsule[ROBOT_CAPSULES_MAX];
    int leg_pairs;                        /* of capsules of different legs */
    int leg_pair[ROBOT_LEG_PAIRS_MAX][2]; /* numbers of capsules */
    double total_mass;                    /* [kg] */
    double stand_height;                  /* [m] base above the soles in the default pose */
    RobotTable table;                     /* what the task needs of all this */
} Robot;

/* Compiles the MJCF at robot->path into robot->visual. Compiles the part that a step needs, with a
 * floor and the feet's corners, into robot->model. */
MildStatus robot_load_models(Robot *robot, MildError *error);

/* Checks the numbers of a compiled model, which MuJoCo takes from the MJCF without question: they
 * must be finite, and masses, inertias, gains and limits must have the right sign. */
MildStatus robot_check_model(const mjModel *model, const char *path, MildError *error);

/* Id of a named object, or -1 with a message that names the key that refers to it. */
int robot_find(const Robot *robot, const mjModel *model, int type, const char *kind,
               const char *name, const char *key, MildError *error);
/* Body of robot->model that has the geom of robot->visual; -1: it has no name. */
int robot_geom_body(const Robot *robot, int geom, MildError *error);
/* Sets the degrees of freedom of a limb from its body, and those that it shares with the limbs
 * before it. */
void robot_read_limb(Robot *robot, int limb);
/* Centre of corner c < ROBOT_SHELL_CORNERS of a shell's box, body frame. Bool: it has one. */
int robot_shell_corner(const RobotShell *shell, int c, double center[3]);
/* The shells of a limb behind the feet, as mild_sole_surface takes them. Returns how many. */
int robot_shell_shapes(const Robot *robot, int limb, MildShape shapes[ROBOT_SHELLS_MAX]);

/* Gives the feet their own rasters again. */
void robot_take_rasters(Robot *robot);

/* ---- parts of robot_create, in the order of their calls; each needs the ones before it ---- */
/* What robot.ini and the compiled models say: bodies, joints, limbs, shells, legs, soles. */
MildStatus robot_read_models(Robot *robot, MildError *error);
MildStatus robot_read_shells(Robot *robot, MildError *error);
MildStatus robot_read_legs(Robot *robot, MildError *error);
MildStatus robot_read_shell_soles(Robot *robot, MildError *error);

#endif
