/* Working arrays of a contact step: the listed elements of every foot and their law. */
#ifndef MILD_GROUND_SCRATCH_H
#define MILD_GROUND_SCRATCH_H

#include "ground/sole/sole.h"
#include "ground/step/slots.h"
#include "ground/step/state.h"

#define TWIST_MAX (6 * MILD_FEET_MAX)
#define ROW_LANES (TWIST_MAX + 8) /* numbers of a row of the equations: newton_step.h */
#define PADDING_DEPTH (-1e3)      /* [m] depth of the padding, which never touches the ground */

/* What a material gives a slot. */
typedef struct {
    Law law;
    Share share;     /* the material's numbers of it, with its friction */
    double k_drift;  /* [N/m^2] 0 where path costs support */
    double b_drift;  /* [N s/m] */
    double recovery; /* [-] */
} SlotLaw;

/* Law of a material as last derived. It is valid while the material's bytes stay the same. */
typedef struct {
    MildMaterial material;
    SlotLaw slot;
    int curves; /* LawCurve bits of the law */
    int known;  /* bool: the law has been derived */
    int nan;    /* bool: a number of the law or the material is NaN */
} DerivedLaw;

typedef struct FootScratch {
    /* The sole: mild_scratch_create. */
    int elements;    /* number of elements */
    int padded;      /* the same, rounded up to whole vectors */
    double *x;       /* [padded] [m] element centres in the foot frame */
    double *y;       /* [padded] [m] */
    double z;        /* [m] sole plane in the foot frame */
    double pitch;    /* [m] edge of an element */
    double width;    /* [m] shorter side of the sole */
    double center_x; /* [m] centroid in the foot frame */
    double center_y; /* [m] */
    double radius;   /* [m] distance from the ankle to the farthest element */
    SoleHeap *heap;  /* [elements] */

    double middle[3]; /* [m] of the bounding box, foot frame */
    double half[3];   /* [m] half of its sides */

    /* A shell (shell.c): mild_scratch_create. NULL and 0 for a plane sole. */
    int shell;          /* SLOT_SHELL, or 0: all elements lie at z and face down */
    double *height;     /* [padded] [m] above z, in the foot frame */
    double *face[3];    /* [padded] [-] outward normal, foot frame */
    double *area;       /* [padded] [-] area over pitch^2 */
    double *area_share; /* [padded] [-] projected area over pitch^2; 0: faces up. shell_locate */
    double least;       /* [m] elements deeper than this may touch: foot_set_least */

    /* Pose: foot_set_pose; frame and lever: foot_frame; depths and gradients: foot_locate,
     * shell_list. The vector from the ankle to an element is
     * p = arm[0] + x arm[1] + y arm[2] + height arm[3]. */
    double origin[3];   /* [m] the ankle, world */
    double arm[4][3];   /* world: the frame's point (0, 0, z) [m], its axes [-], z for a shell */
    int framed;         /* bool: the sole presses in a frame of its own */
    Real frame[3];      /* [-] its axis: foot_frame */
    double lever[4][3]; /* the arms in that frame */
    int uneven;         /* bool: the terrain is not level; otherwise all slopes are 0 */
    int away;           /* bool: no element can touch; depth and area_share are not set */
    double reach;       /* [m] upper bound on the depths: foot_reach */
    double *depth;      /* [padded] [m] */
    double *slope_x;    /* [padded] [-] gradient of the ground; uneven ground only */
    double *slope_y;    /* [padded] [-] */
    double *point_x;    /* [padded] [m] centres in the world: foot_points */
    double *point_y;    /* [padded] [m] */
    double *point_z;    /* [padded] [m] */

    /* List of the elements that may touch the ground: foot_list. */
    int active;       /* slots in use */
    int whole;        /* bool: element[] lists all elements */
    int32_t *element; /* [active] element of each slot, ascending */

    /* Law of each slot: foot_laws, foot_prepare. */
    int curves; /* LawCurve bits of the terrain's materials */
    int nan;    /* bool: a material of the terrain contains NaN */
    int turned; /* bool: turn_x or turn_y may be nonzero */
    int stops;  /* bool: stop_drag, stop_growth or explicit_impulse may be nonzero */
    /* [SLOTS_PADDED] Material whose law the slot has, encoded as in Memory. */
    int32_t *slot_material;
    int32_t *slot_holder; /* [SLOTS_PADDED] element whose law it has, for heaps */
    DerivedLaw derived[MILD_MATERIALS_MAX];
    Slots *slot; /* [SLOTS_PADDED(padded)/SLOT_LANES] blocks */

    /* Output of mild_scratch_elements, arrays [padded], see MildElements. */
    double *normal;    /* [N] */
    double *tangent_x; /* [N] */
    double *tangent_y; /* [N] */
    double *flat;      /* [-] */
    uint8_t *state;    /* MildElementState */
    uint8_t *slip;     /* bool */
} FootScratch;

struct MildScratch {
    int feet;
    int32_t shells; /* bit f: foot f is a shell */
    /* Feet in the step's equations: contact_prepare. */
    int given;                      /* feet that input.inverse_inertia has rows of */
    int place[MILD_FEET_MAX];       /* index of a foot among these; -1: none */
    int listed;                     /* feet with listed elements */
    int list[MILD_FEET_MAX];        /* [listed] their indices, ascending */
    double *rows;                   /* [2][6 feet][ROW_LANES] of Newton's method */
    double window[2 * ROW_LANES];   /* 1 at ROW_LANES, else 0: newton_step.c */
    double sums[MILD_FEET_MAX][12]; /* [N s, N s m] of I, x I, y I, height I at the last pass */
    double wrench[TWIST_MAX];       /* [N s, N m s] sum of B^T I at the last pass, in the frames */
    /* [kg, kg m, kg m^2] -d wrench/d twist of each foot, 6 x 6, row major, in its frame. */
    double hessian[MILD_FEET_MAX][36];
    double velocity[TWIST_MAX]; /* [m/s, rad/s] V+ of the last solve, in the frames of the feet */
    MildContactInput input;     /* input_of_world, whose inverse inertia is */
    double inverse[TWIST_MAX * TWIST_MAX];
    double dt;          /* [s] of the last solve */
    int is_number;      /* bool: its problem and all of its results are finite */
    double *block;      /* the one allocation behind all arrays */
    FootScratch foot[]; /* [feet] */
};

/* Bool: made for soles of the same numbers of elements as the ground. */
int scratch_fits(const MildScratch *scratch, const MildGround *ground);
/* Computes the world position of every element: point_x, point_y, point_z. */
void foot_points(const FootScratch *foot);
/* The force of ground without memory under each slot [N], into the working array fx. */
void slots_elastic(const FootScratch *foot);

/* Slots in use, rounded up to whole blocks. */
static inline int foot_end(const FootScratch *foot) {
    return (foot->active + SLOT_LANES - 1) / SLOT_LANES * SLOT_LANES;
}

/* One past the last block in use. */
static inline Slots *slots_end(const FootScratch *foot) {
    return foot->slot + (foot->active + SLOT_LANES - 1) / SLOT_LANES;
}

/* Slots of `padded` elements: arrays over elements are padded to VECTOR_LANES, half a block of
 * floats. */
#if SLOT_BYTES / 4 > VECTOR_LANES && defined(MILD_REAL_FLOAT)
#define SLOTS_PADDED(padded) (((padded) + SLOT_LANES - 1) / SLOT_LANES * SLOT_LANES)
#else
#define SLOTS_PADDED(padded) (padded)
#endif

/* One past the last block, in use or not. */
static inline Slots *slots_all(const FootScratch *foot) {
    return foot->slot + SLOTS_PADDED(foot->padded) / SLOT_LANES;
}

/* Bool: all elements are listed, and their arrays are whole blocks. */
static inline int slots_are_whole(const FootScratch *foot) {
    return foot->active == foot->elements && foot->padded % SLOT_LANES == 0;
}

/* The block of slot i. Its lane there is i % SLOT_LANES. */
static inline Slots *slot_block(const FootScratch *foot, int i) {
    return foot->slot + i / SLOT_LANES;
}

/* The curves of the compiled loop for a foot. The loop of all curves is also that of shells: it
 * counts with the heights of the elements, which are 0 in a plane sole. */
static inline int foot_variant(const FootScratch *foot) {
    return foot->shell ? LAW_ANY : law_variant(foot->curves);
}

/* The velocity field of a foot with the twist V. */
Motion foot_motion(const FootScratch *foot, const double *V);
/* The same in the loops of a pass. */
static inline Motion foot_moves(const FootScratch *foot, const double *V) {
#ifdef MILD_REAL_FLOAT
    Real arm[3][3], twist[6];
    for (int k = 0; k < 9; k++) {
        arm[k / 3][k % 3] = (Real)foot->lever[k / 3][k % 3];
    }
    for (int k = 0; k < 6; k++) {
        twist[k] = (Real)V[k];
    }
    Motion motion = motion_of(arm, twist);
#else
    Motion motion = motion_of(foot->lever, V);
#endif
    if (foot->shell) {
        const double *q = foot->lever[3];
        const double x = V[5] * q[1], y = V[3] * q[2]; /* first: pass.c fuses these products */
        motion.lift[0] = V[4] * q[2] - x;
        motion.lift[1] = V[5] * q[0] - y;
        motion.lift[2] = V[3] * q[1] - V[4] * q[0];
    }
    return motion;
}

/* p: vector from the ankle to the element of a slot, in the foot's frame. */
static inline void slot_arm(const FootScratch *foot, const Slots *s, int i, double p[3]) {
    for (int k = 0; k < 3; k++) {
        p[k] = foot->lever[0][k] + foot->lever[1][k] * s->x[i] + foot->lever[2][k] * s->y[i] +
               foot->lever[3][k] * s->z[i];
    }
}

/* ---- derivative_free.c: how the law of a step depends on the free motion ---- */

/* block: dP/dV^ [kg, kg m, kg m^2] of the impulses on foot f at fixed twists, in its frame. Where
 * it stops in virgin ground, drag starts at a speed that the free motion raises (element_drag);
 * ground that creates energy (passive = false) is explicit (element_explicit). Both are forces that
 * follow the descent, so with g = (-slope, 1), c = g + d friction/dI_z and k = dI_z/dw of the free
 * motion it is the sum of -k (B^T c) (B^T g)^T, as H is of h of pass.c. twist: V of the foot,
 * world. */
void foot_free(const FootScratch *foot, const MildContactInput *input, int f, const double *twist,
               double block[36]);

#endif
