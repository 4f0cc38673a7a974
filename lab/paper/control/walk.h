/* The walk of a biped as a plan: which feet stand, where the next foot goes, and where the DCM
 * should be. A step is a double support, in which the virtual repellent point moves from one foot
 * to the next, and a single support, in which it stays and the other foot swings. */
#ifndef CONTROL_WALK_H
#define CONTROL_WALK_H

/* The divergent component of motion (DCM) xi = x + b v of the centre of mass x with velocity v, and
 * its plan. With b = sqrt(height / g) and the virtual repellent point p, which lies `height` above
 * the point that the ground's force on the centre of mass comes from (Englsberger, Ott and
 * Albu-Schaeffer 2015),
 *
 *     b^2 a = x - p,    b v = xi - x,    b xi' = xi - p.
 *
 * xi runs away from p, so a plan is found backwards in time: where p goes is given by the feet, and
 * xi must come to rest where p does. */

/* p(t) = from + (to - from) t / duration + sway cos(angle + rate t) */
typedef struct {
    double from[3];  /* [m] */
    double to[3];    /* [m] */
    double duration; /* [s] 0: nothing */
    double sway[3];  /* [m] */
    double angle;    /* [rad] */
    double rate;     /* [rad/s] */
} DcmSegment;

/* [m] p at the start of a segment. */
void dcm_point(const DcmSegment *segment, double point[3]);
/* xi [m] at the start of the first of `count` segments, for which it is at rest at the end of the
 * last one. b: [s]. */
void dcm_plan(const DcmSegment *segments, int count, double b, double xi[3]);

enum { WALK_FEET = 2 };

/* Numbers of a walk. */
typedef struct {
    double b;              /* [s] sqrt(height / g) */
    double height;         /* [m] of the centre of mass above the soles */
    double acceleration;   /* [m/s^2, rad/s^2] of the command */
    double settle_time;    /* [s] in which a stand moves over the middle of the feet */
    double step_time;      /* [s] double and single support */
    double double_support; /* [-] share of the step */
    double start_time;     /* [s] of the first double support, out of the stand */
    double width;          /* [m] lateral distance of the feet */
    double width_least;    /* [m] of the nearer foothold with a lateral command */
    double clearance;      /* [m] height of the swing over the straight line */
    double search_speed;   /* [m/s] downward, of a foot that has not found the ground in time */
    double search_time;    /* [s] longest search */
    double touch_force;    /* [N] that says that a foot is down */
    double sway;           /* [s^2] displacement of p per acceleration of the swing foot */
    double adjust;         /* [-] part of the DCM's error by which the foothold moves */
    double adjust_most;    /* [m] */
} WalkDef;

/* What the robot measures. */
typedef struct {
    double support[WALK_FEET][3]; /* [m] points under the ankles */
    double yaw[WALK_FEET];        /* [rad] */
    double force[WALK_FEET];      /* [N] vertical */
    double dcm[3];                /* [m] */
    double base_yaw;              /* [rad] */
} WalkState;

typedef enum { WALK_STAND, WALK_DOUBLE, WALK_SINGLE } WalkPhase;

typedef struct {
    WalkPhase phase;
    double time;        /* [s] in this phase */
    double duration;    /* [s] of this phase */
    int left;           /* foot on the left */
    int starts;         /* bool: the first double support out of a stand */
    int stance;         /* foot that stands in single support, or will after double support */
    double heading;     /* [rad] at the end of this step */
    double before;      /* [rad] at its start */
    double rest[3];     /* [m] virtual repellent point less its height, in a stand */
    double from[3];     /* [m] where the virtual repellent point was when double support began */
    double lift[3];     /* [m] support point of the swing foot when it left the ground */
    double lift_yaw;    /* [rad] */
    double foothold[3]; /* [m] planned support point of the swing foot */
    double moved[2];    /* [m] of the foothold by the DCM's error */
    double command[3];  /* [m/s, m/s, rad/s] vx, vy, wz */
} Walk;

/* Where things should be now. */
typedef struct {
    int stands[WALK_FEET];   /* bool */
    double share[WALK_FEET]; /* [-] of the greatest load that the foot may take, 0 .. 1 */
    double point[3];         /* [m] virtual repellent point p */
    double dcm[3];           /* [m] */
    double base_yaw;         /* [rad] */
    double base_yaw_rate;    /* [rad/s] */
    int still;               /* bool: in a stand, or before the first step out of it */
    int swing;               /* foot in the air, or -1 */
    double position[3];      /* [m] of its support point */
    double velocity[3];      /* [m/s] */
    double acceleration[3];  /* [m/s^2] */
    double yaw;              /* [rad] */
    double level;            /* [-] 0 .. 1: how far its sole has been levelled */
} WalkTarget;

WalkDef walk_def_default(void);
/* Begins standing. */
void walk_start(Walk *walk, const WalkDef *def, const WalkState *state);
/* Moves on by dt [s]. command: vx, vy, wz in the heading frame. */
void walk_advance(Walk *walk, const WalkDef *def, const WalkState *state, const double command[3],
                  double dt);
void walk_target(const Walk *walk, const WalkDef *def, const WalkState *state, WalkTarget *target);

#endif
