/* Private to the robot layer: robot.ini as numbers and names. docs/robots.md lists every key. */
#ifndef ROBOT_DEF_H
#define ROBOT_DEF_H

#include "robot/limits.h"

#define ROBOT_NAME_SIZE 64
#define ROBOT_SHELLS_MAX 32   /* geoms beside soles that meet the ground */
#define ROBOT_SHELL_CORNERS 8 /* of a box */
#define ROBOT_FLOOR_POINTS 64 /* of shells that touch rigid ground at once, at most */
#define ROBOT_CAPSULES_MAX 16 /* geoms by which legs touch each other */
#define ROBOT_LEG_PAIRS_MAX 64
#define ROBOT_OUTLINE_MAX 128 /* points of a sole's outline */
#define ROBOT_CORNERS_MAX 16  /* spheres of a foot on the engine's rigid ground */
#define ROBOT_ELEMENTS_MAX 65536

typedef char RobotName[ROBOT_NAME_SIZE];

typedef enum { ROBOT_SOLE_OUTLINE, ROBOT_SOLE_ROUND } RobotSoleShape;

/* Section [foot.NAME]. Lengths are in the frame of the foot's body. */
typedef struct {
    RobotName name;   /* of the section */
    RobotName body;   /* that carries the sole */
    RobotName knee;   /* body whose origin is the knee */
    RobotName mirror; /* foot on the other side, or the foot itself */
    RobotName ankle;  /* joint that pitches a flat sole; empty: none */
    double offset;    /* [-] share of the gait cycle at which the foot's stance begins */
    int shape;        /* RobotSoleShape */
    /* a flat sole */
    double outline[2 * ROBOT_OUTLINE_MAX]; /* [m] x y of each point */
    int outline_points;
    double z; /* [m] plane of the sole */
    /* a round foot */
    double center[3]; /* [m] of the sphere */
    double radius;    /* [m] */
    /* both */
    double pitch;                          /* [m] edge of a ground element */
    int elements;                          /* of the sole; 0: as many as fit */
    double corners[3 * ROBOT_CORNERS_MAX]; /* [m] centres of the spheres on rigid ground */
    int corner_count;
    double corner_radius; /* [m] */
} RobotFootDef;

typedef struct {
    /* section [robot] */
    RobotName name;
    char model[256];  /* MJCF, relative to the folder */
    char source[256]; /* whose numbers these are, under which licence */
    RobotName base;   /* body with the free joint */
    RobotName shell[ROBOT_SHELLS_MAX];
    int shells;
    RobotName leg[ROBOT_CAPSULES_MAX];
    double shell_spacing; /* [m] distance of the shells' ground elements */
    int legs;             /* 0: legs do not touch each other */
    double height;        /* [m] wanted height of the base above the stance soles */
    double action_scale;  /* [rad] joint offset per unit of action */
    double feet_range[2]; /* [m] limits of the lateral distance of mirrored feet */
    double knee_range[2]; /* [m] of mirrored knees */
    double feet_least;    /* [m] lateral distance below which mirrored feet collide */
    double knee_least;    /* [m] and knees */
    double foot_force;    /* [N] force on a foot above which a landing is hard */
    double assist[4];     /* [N m/rad, N m s/rad, N s/m, N] assistance, see RobotTable */
    /* section [joints], in the order of observations and actions */
    int joints;
    RobotName joint[ROBOT_JOINTS_MAX];
    RobotName mirror[ROBOT_JOINTS_MAX];   /* joint on the other side */
    double mirror_sign[ROBOT_JOINTS_MAX]; /* [-] q mirrored = sign times q of the other side */
    double pose[ROBOT_JOINTS_MAX];        /* [rad] */
    double kp[ROBOT_JOINTS_MAX];          /* [N m/rad] */
    double kd[ROBOT_JOINTS_MAX];          /* [N m s/rad] */
    double stand_kp[ROBOT_JOINTS_MAX];    /* [N m/rad] of the controller `stand` */
    double stand_kd[ROBOT_JOINTS_MAX];    /* [N m s/rad] */
    double effort[ROBOT_JOINTS_MAX];      /* [N m] 0: actuatorfrcrange of the MJCF */
    double speed[ROBOT_JOINTS_MAX];       /* [rad/s] 0: no limit */
    double full_speed[ROBOT_JOINTS_MAX];  /* [rad/s] see RobotTable */
    double swing[ROBOT_JOINTS_MAX];       /* [-] amplitude in the reference swing motion */
    double still[ROBOT_JOINTS_MAX];       /* [-] 1: should stay near the pose, 0: may move */
    int driven; /* joints that another program moves, not the policy: the last of the joints */
    /* sections [foot.NAME] */
    int feet;
    double mirror_shift; /* [-] 0 or 0.5 gait cycles between a gait and its mirror image */
    RobotFootDef foot[ROBOT_FEET_MAX];
} RobotDef;

/* Reads folder/robot.ini and checks everything that needs no MJCF. */
MildStatus robot_def_read(const char *folder, RobotDef *def, MildError *error);
/* The same from the text of the file `path`. */
MildStatus robot_def_parse(const char *text, const char *path, RobotDef *def, MildError *error);

#endif
