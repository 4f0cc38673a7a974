/* One contact step, inside: the compacted list of elements that may touch, and the per-step law of
 * each. */
#ifndef MILD_GROUND_CONTACT_H
#define MILD_GROUND_CONTACT_H

#include "ground/law.h"

#define CONTACT_LANES 8 /* lists are padded to whole vectors; padding never makes a force */
#define CONTACT_ELASTIC                                                                            \
    1e-4 /* [m] least elastic travel of the unloading line: plastic ground is elastic that far;    \
            friction's own is in friction.h */
/* For loops over the slots in two variants: compiled into its caller with constant arguments, with
 * a copy of Slots, so that the compiler keeps the arrays' addresses in registers; else it reads
 * them anew, and the loop is not in vectors. */
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#define TWIST_MAX (6 * MILD_FEET_MAX)

struct MildGround {
    int32_t feet;
    int32_t elements[MILD_FEET_MAX], padded[MILD_FEET_MAX];
    int32_t touched[MILD_FEET_MAX]; /* elements that remember something */
    int32_t uneven[MILD_FEET_MAX];  /* bool: the planes below are those of the step before */
    int32_t tiles;                  /* of prints, see prints.h */
    uint32_t print_time;            /* counts the steps that changed a print */
    double print_cell;              /* [m] */
    int32_t reserved[2];            /* to 64 bytes, so that the arrays behind are aligned */
};

/* What an element stands on: index of a material, or first | second << 8 | share << 16 of two that
 * blend (255: all of the second); or, negative, that it carries nothing. */
#define MATERIAL_NONE (-1) /* and nothing is known of the step before */
#define MATERIAL_FREE (-2) /* but it was near the ground in the step before */

/* Memory of one foot, arrays inside the state block. */
typedef struct {
    double *depth_max; /* [m] u_max, 0 = untouched */
    double *middle; /* [m] depth in the middle of the last step, where the next one's way begins */
    double *front_speed; /* [m/s] downward speed of the added mass while the element leads the
                            front, else 0 */
    double *drift;       /* [m] d_D */
    double *pending_x, *pending_y; /* [m] horizontal motion not yet counted into d_D */
    double *held_x, *held_y;       /* [N] of friction that is held at rest */
    double *grip;                  /* [N/m] its stiffness */
    double *plane, *slope_x,
        *slope_y;      /* uneven ground: u = plane + slope . (x, y) - z of the step before, world */
    int32_t *material; /* the material it touched down on; see above */
} Memory;

Memory ground_memory(const MildGround *ground, int foot);

int terrain_is_level(const MildTerrain *terrain);
int terrain_is_uniform(const MildTerrain *terrain); /* bool: material 0 everywhere */
/* Bound of the gradient's length [-]. */
double terrain_steepest(const MildTerrain *terrain);
/* Height and gradient of the ground under a point. */
double terrain_surface(const MildTerrain *terrain, double x, double y, double slope[2]);
/* The material there, coded as in Memory. */
int32_t terrain_mixture(const MildTerrain *terrain, double x, double y);

/* Structure of arrays over the slots of a foot: its list, padded. */
typedef struct {
    double *x, *y; /* [m] element's centre in the foot frame */
    double *slope_x,
        *slope_y; /* [-] gradient of the ground under it; 0 where the foot is not `uneven` */
    /* normal law of this step, see step.h */
    double *depth, *middle, *front, *deep, *line, *slack, *reach, *front_speed, *speed, *mass,
        *join, *leave, *bend, *stopped, *explicit_impulse;
    double *flat, *cone, *full, *inverse_full, *drag, *bed, *bed_stiffness; /* Law */
    double *mu, *drift_radius, *damping; /* [-], [N s], [N s/m * s] */
    double *hold_x, *hold_y,
        *grip; /* [N s], [N s], [kg] friction at rest: dt the force held, dt^2 its stiffness */
    double *k_drift, *b_drift, *recovery, *mass_rate; /* material, for the preparation */
    double *depth_max, *remembered_middle, *remembered_speed, *drift; /* memory */
    double *pending_x, *pending_y, *held_x, *held_y, *held_grip;
    double *strength; /* [N/m] the law's cone before it depends on direction; resistive force
                         theory, see resist.c */
    /* written by the passes */
    double *ix, *iy, *iz; /* [N s] impulse */
    double *fx, *fy;      /* [N s] friction without the drift damping; sweeps only */
    double *bound;        /* [N s] of friction, where it is held */
    double *hxx, *hxy, *hxz, *hyy, *hyz,
        *hzz; /* [kg] minus the impulse's derivative by the element's velocity; on level */
    double *hyx, *hzx, *hzy; /* ground hyx = hxy, hzx = hzy = 0, and these are left out */
} Slots;
#define SLOT_ARRAYS (sizeof(Slots) / sizeof(double *))

/* Law of a material as last derived; valid while the material's bytes stay the same. */
typedef struct {
    MildMaterial material;
    Law law;
    int known, nan; /* bools; nan: a number of it is none */
} DerivedLaw;

typedef struct {
    int elements, padded, active; /* active: slots in use */
    int whole;                    /* bool: element[] lists all */
    int nan;                      /* bool: a material of the terrain is not a number */
    int bent;         /* bool: the slots' bend, stopped and explicit_impulse are not all 0 */
    int uneven;       /* bool: the ground under it is not level; otherwise all its slopes are 0 */
    double origin[3]; /* [m] the ankle, world */
    double arm[3][3]; /* [m] ankle -> the frame's point (0, 0, sole), then the frame's x and y axes:
                         p = arm0 + x arm1 + y arm2 */
    double center_x, center_y,
        radius;    /* [m] centroid in the foot frame; reach of the sole from the ankle */
    double *x, *y; /* [m] element centres in the foot frame */
    double z, pitch;
    double *depth, *normal, *tangent_x, *tangent_y, *point_x, *point_y, *point_z,
        *flat;                 /* MildElements */
    double *slope_x, *slope_y; /* [-] of the ground under each element; uneven ground only */
    uint8_t *state, *slip;
    int32_t *element; /* [active] element of each slot, ascending */
    Slots slot; /* own; or, when all are listed, x, y, depth and memory where they lie, to be read
                   only */
    Slots own;
    int32_t
        *slot_material; /* whose law stands in the slot's Law arrays, coded as in Memory; -1 none */
    DerivedLaw derived[MILD_MATERIALS_MAX];
} FootScratch;

struct MildScratch {
    int feet;
    FootScratch foot[MILD_FEET_MAX];
    double wrench[TWIST_MAX];          /* [N s, N m s] sum of B^T I at the last pass */
    double velocity[TWIST_MAX], dt;    /* of the last solve: V+ and the step */
    double hessian[MILD_FEET_MAX][36]; /* [kg ...] per foot, minus d wrench / d twist, row major */
    double *block;                     /* the one allocation behind all arrays */
};

/* The memory's arrays in place of the slots' own copies. */
void slots_remember(Slots *s, const Memory *memory);
/* Where every element is: point_x, y, z. */
void foot_points(const FootScratch *foot);
/* Fills the lists and each slot's law for this step; returns the number of elements that may touch.
 */
int contact_prepare(const MildGround *ground, const MildTerrain *terrain,
                    const MildContactInput *input, MildScratch *scratch);

/* Impulses of every slot at the loaded feet's twists V, their derivatives and their wrench. twist:
 * rows `first` and on. */
void contact_pass(MildScratch *scratch, double dt, const double *twist, int first);
/* The same with the bounds of friction held at slot.bound, which makes the impulses minus the
 * gradient of a convex function. */
void contact_pass_held(MildScratch *scratch, double dt, const double *twist, int first);
/* Moves these by a share of the way to what the normal impulses of the last pass ask for; share = 1
 * sets them. */
void contact_bounds(MildScratch *scratch, double share);
/* hessian from the derivatives of the last pass. */
void contact_hessian(MildScratch *scratch);
/* A foot's velocity field: that of the element at (x, y) in its frame has the component x[0] + x[1]
 * x + x[2] y along the world's x axis, and so on. */
typedef struct {
    double x[3], y[3], z[3];
} Motion;

static inline Motion foot_motion(const FootScratch *foot, const double *V) {
    Motion m;
    for (int k = 0; k < 3; k++) {
        const double *q = foot->arm[k];
        m.x[k] = V[4] * q[2] - V[5] * q[1] + (k ? 0.0 : V[0]);
        m.y[k] = V[5] * q[0] - V[3] * q[2] + (k ? 0.0 : V[1]);
        m.z[k] = V[3] * q[1] - V[4] * q[0] + (k ? 0.0 : V[2]);
    }
    return m;
}

static inline double motion_at(const double m[3], double x, double y) {
    return m[0] + m[1] * x + m[2] * y;
}

/* Speed w at which a slot's depth grows: u = h0(x, y) - z, so w = slope . v_xy - v_z. */
static inline double slot_descent(const Slots *s, int i, const Motion *m) {
    double x = s->x[i], y = s->y[i];
    return s->slope_x[i] * motion_at(m->x, x, y) + s->slope_y[i] * motion_at(m->y, x, y) -
           motion_at(m->z, x, y);
}

/* p, ankle -> element, world axes. */
static inline void slot_arm(const FootScratch *foot, const Slots *s, int i, double p[3]) {
    for (int k = 0; k < 3; k++) {
        p[k] = foot->arm[0][k] + foot->arm[1][k] * s->x[i] + foot->arm[2][k] * s->y[i];
    }
}

static inline int foot_end(const FootScratch *foot) {
    return (foot->active + CONTACT_LANES - 1) / CONTACT_LANES * CONTACT_LANES;
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);
void sweep_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);

#endif
