/* How the links of a robot hang together: whole numbers that are the same in any scalar type.
 *
 * Link 0 is the base with its six degrees of freedom (linear velocity in world axes, angular
 * velocity in base axes); every hinge has a link behind it, and link i moves with the degree of
 * freedom 5 + i. The order is that of the mjModel: a link comes after its parent, and the links
 * that hang on link i are i + 1 .. end[i] - 1. A body with several hinges is several links, all but
 * the last without mass. Bodies without a joint are part of the link that carries them.
 *
 * M and its factor are stored by rows. The row of a degree of freedom has one entry for each of its
 * ancestors, root first, and one for itself; no other entry of that row is ever other than zero. So
 * the place of an ancestor in a row is the number of degrees of freedom above it, the same in all
 * rows. */
#ifndef MILD_ENGINE_TREE_H
#define MILD_ENGINE_TREE_H

#include "robot/def.h"

#define ENGINE_LINKS_MAX (1 + ROBOT_JOINTS_MAX)
#define ENGINE_DOFS_MAX ROBOT_NV_MAX
#define ENGINE_ENTRIES_MAX (ENGINE_DOFS_MAX * (ENGINE_DOFS_MAX + 1) / 2) /* of a single chain */
#define ENGINE_CORNERS_MAX 64 /* spheres under the feet on rigid ground */
#define ENGINE_BASE_ENTRIES 21
#define ENGINE_BODIES_MAX 9 /* with shells that stand: those of the Go1 */

typedef unsigned char EngineIndex;
typedef unsigned long long EnginePath; /* a bit for each degree of freedom */

/* An entry of M. */
typedef struct {
    EngineIndex dof;    /* whose row */
    EngineIndex place;  /* where in it */
    EngineIndex behind; /* EngineTree.behind of the row */
} EngineEntry;

typedef struct {
    int joints;
    int feet;
    int corners; /* of all feet */
    int levels;  /* of the tree; the base is level 0 */
    int entries; /* of M */
    int chain;   /* entries of the longest row of M */
    int leaves;  /* links that carry no other */
    /* ---- links ---- */
    EngineIndex parent[ENGINE_LINKS_MAX];
    EngineIndex level[ENGINE_LINKS_MAX]; /* number of hinges between the link and the base */
    EngineIndex end[ENGINE_LINKS_MAX];   /* behind the last link that hangs on it */
    EngineIndex joint[ENGINE_LINKS_MAX]; /* the link's hinge in the order of robot.ini */
    EngineIndex scale[ENGINE_LINKS_MAX]; /* its body's place in RobotVariation.link_mass_scale */
    /* The degrees of freedom down to a link: the base's six, then a hinge on each level. */
    EngineIndex row_dof[ENGINE_LINKS_MAX][ENGINE_DOFS_MAX];
    EngineIndex leaf[ENGINE_LINKS_MAX];      /* [leaves] */
    EngineIndex base_link[ENGINE_LINKS_MAX]; /* [base_links] links that hang on the base */
    int base_links;
    /* ---- M ---- */
    EnginePath path[ENGINE_DOFS_MAX];   /* of a degree of freedom: its ancestors and itself */
    EngineIndex above[ENGINE_DOFS_MAX]; /* how many are above it: its place in the rows behind it */
    EngineIndex behind[ENGINE_DOFS_MAX]; /* the first one that does not move with it or before it */
    /* Entries level by level, those of the base first. */
    short level_entry[ENGINE_LINKS_MAX + 1]; /* [levels + 1] where those of a level begin */
    EngineEntry entry[ENGINE_ENTRIES_MAX];
    /* ---- feet ---- */
    EngineIndex foot_link[ROBOT_FEET_MAX];  /* link that carries the sole */
    EngineIndex foot_round[ROBOT_FEET_MAX]; /* bool: transmits no moment */
    /* Degrees of freedom that move both feet; of a foot and itself, the entries of its row. */
    EngineIndex shared[ROBOT_FEET_MAX][ROBOT_FEET_MAX];
    EngineIndex knee_link[ROBOT_FEET_MAX];
    short outline_points[ROBOT_FEET_MAX];    /* of a flat sole; round: 0 */
    int pairs;                               /* of mirrored feet */
    EngineIndex pair[ROBOT_FEET_MAX / 2][2]; /* left foot, right foot */
    EngineIndex corner_foot[ENGINE_CORNERS_MAX];
    EngineIndex corner_begin[ROBOT_FEET_MAX + 1]; /* corners of a foot: from its own to the next */
    /* ---- shells ---- */
    int shells;
    EngineIndex shell_link[ROBOT_SHELLS_MAX];
    EngineIndex shell_body[ROBOT_SHELLS_MAX]; /* ENGINE_BODIES_MAX: does not stand */
    /* ---- bodies with shells, where these stand ---- */
    int bodies;
    EngineIndex body_link[ENGINE_BODIES_MAX];
    /* Degrees of freedom that move a body and a foot, or another body: they follow the feet. */
    EngineIndex body_shared[ENGINE_BODIES_MAX][ROBOT_FEET_MAX + ENGINE_BODIES_MAX];
    /* ---- parts of legs that touch other legs ---- */
    EngineIndex capsule_link[ROBOT_CAPSULES_MAX];
    int leg_pairs;
    EngineIndex leg_pair[ROBOT_LEG_PAIRS_MAX][2];
} EngineTree;

#endif
