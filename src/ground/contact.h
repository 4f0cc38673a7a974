/* One contact step, inside: the compacted list of elements that may touch, and the per-step law of each. */
#ifndef MILD_GROUND_CONTACT_H
#define MILD_GROUND_CONTACT_H

#include "ground/law.h"

#define CONTACT_LANES 8         /* lists are padded to whole vectors; padding never makes a force */
#define CONTACT_SLIP_SPEED 1e-6 /* [m/s] width of the friction law's stick region; a standing foot creeps slower than this */
#define CONTACT_ELASTIC 1e-4    /* [m] least elastic travel of the unloading line: plastic ground is elastic that far */
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

/* What an element stands on: index of a material, or first | second << 8 | share << 16 of two that blend (255: all of the
 * second); or, negative, that it carries nothing. */
#define MATERIAL_NONE (-1) /* and nothing is known of the step before */
#define MATERIAL_FREE (-2) /* but it was near the ground in the step before */

/* Memory of one foot, arrays inside the state block. */
typedef struct {
    double *depth_max;   /* [m] u_max, 0 = untouched */
    double *middle;      /* [m] depth in the middle of the last step, where the next one's way begins */
    double *front_speed; /* [m/s] downward speed of the added mass while the element leads the front, else 0 */
    double *drift;       /* [m] d_D */
    double *pending_x, *pending_y; /* [m] horizontal motion not yet counted into d_D */
    double *plane, *slope_x, *slope_y; /* uneven ground: u = plane + slope . (x, y) - z of the step before, world */
    int32_t *material;   /* the material it touched down on; see above */
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

/* Structure of arrays over the slots: foot 0's list, padding, foot 1's list, padding. */
typedef struct {
    double *px, *py, *pz; /* [m] ankle -> element, world axes */
    double *slope_x, *slope_y; /* [-] gradient of the ground under it; 0 where the foot is not `uneven` */
    /* normal law of this step, see step.h */
    double *depth, *middle, *front, *deep, *line, *slack, *stretch, *reach, *front_speed, *speed, *mass, *join, *leave,
        *explicit_impulse;
    double *flat, *cone, *full, *inverse_full, *drag, *bed, *bed_stiffness; /* Law */
    double *mu, *drift_radius, *damping; /* [-], [N s], [N s/m * s] */
    double *k_drift, *b_drift, *recovery, *mass_rate; /* material, for the preparation */
    double *depth_max, *drift;                       /* memory, compacted */
    double *strength; /* [N/m] the law's cone before it depends on direction; resistive force theory, see resist.c */
    /* written by the passes */
    double *ix, *iy, *iz;                         /* [N s] impulse */
    double *fx, *fy;                              /* [N s] friction without the drift damping; sweeps only */
    double *lx, *ly;                              /* [-] direction of friction as an unknown of its own; see pass.c */
    double *hxx, *hxy, *hyy, *hzz, *hxz, *hyz;     /* [kg] minus the impulse's derivative by the element's velocity */
} Slots;
#define SLOT_ARRAYS (sizeof(Slots) / sizeof(double *))

typedef struct {
    int elements, padded, active, start; /* start: first slot of the foot's list */
    int uneven;                          /* bool: the ground under it is not level; otherwise all its slopes are 0 */
    double center_x, center_y, radius;  /* [m] centroid in the foot frame; reach of the sole from the ankle */
    const double *x, *y;                 /* [m] element centres in the foot frame */
    double z, pitch;
    double *depth, *normal, *tangent_x, *tangent_y, *point_x, *point_y, *point_z, *flat; /* MildElements */
    double *slope_x, *slope_y; /* [-] of the ground under each element; uneven ground only */
    uint8_t *state, *slip;
    int32_t *element; /* [active] element of each slot, ascending */
} FootScratch;

/* Law of a material as last derived; valid while the material's bytes stay the same. */
typedef struct {
    MildMaterial material;
    Law law;
    int known;
} DerivedLaw;

struct MildScratch {
    int feet;
    FootScratch foot[MILD_FEET_MAX];
    Slots slot;
    int32_t *slot_material; /* whose law stands in the slot's Law arrays, coded as in Memory; -1 none */
    DerivedLaw derived[MILD_FEET_MAX][MILD_MATERIALS_MAX];
    double wrench[TWIST_MAX]; /* [N s, N m s] sum of B^T I at the last pass */
    double velocity[TWIST_MAX], dt; /* of the last solve: V+ and the step */
    double hessian[MILD_FEET_MAX][36]; /* [kg ...] per foot, minus d wrench / d twist, row major */
    double *block; /* the one allocation behind all arrays */
};

/* Fills the lists and each slot's law for this step; returns the number of elements that may touch. */
int contact_prepare(const MildGround *ground, const MildTerrain *terrain, const MildContactInput *input, MildScratch *scratch);

/* Impulses of every slot at foot twists V, their derivatives and their wrench; eps [m/s]: width of the stick region. */
void contact_pass(MildScratch *scratch, double dt, const double *twist, double eps);
/* Friction directions l carried over a step from one twist to another, and put into the derivatives of the last pass. */
void contact_dual_start(MildScratch *scratch, const double *twist, double eps);
void contact_dual(MildScratch *scratch, const double *from, const double *twist, double eps);
void contact_dual_stiffness(MildScratch *scratch, const double *twist, double eps);
/* hessian from the h arrays of the last pass. */
void contact_hessian(MildScratch *scratch);
/* sqrt(R^T A R) for R = P - wrench: the residual in the metric of kinetic energy. */
double contact_residual(int n, const double *inverse_inertia, const double *impulse, const double *wrench);

/* Speed w at which a slot's depth grows under foot twist V: u = h0(x, y) - z, so w = slope . v_xy - v_z. */
static inline double slot_descent(const Slots *s, int i, const double *V) {
    double px = s->px[i], py = s->py[i], pz = s->pz[i];
    return V[4] * px - V[3] * py - V[2] + s->slope_x[i] * (V[0] + V[4] * pz - V[5] * py) +
           s->slope_y[i] * (V[1] + V[5] * px - V[3] * pz);
}

static inline int foot_end(const FootScratch *foot) {
    return foot->start + (foot->active + CONTACT_LANES - 1) / CONTACT_LANES * CONTACT_LANES;
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);
void sweep_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);

#endif
