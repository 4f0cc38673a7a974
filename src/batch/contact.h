/* The contact step of one robot as the work of a warp: what contact.inc needs and gives.
 *
 * Arrays of a robot lie one behind the other, feet first. A foot's elements are dealt to the lanes
 * of its group: element s is the (s / group)-th one of lane s % group. */
#ifndef MILD_BATCH_CONTACT_H
#define MILD_BATCH_CONTACT_H

#include "batch/lanes.h"
#include "ground/begin.h"
#include "ground/impulse.h"
#include "ground/motion.h"
#include "ground/remember.h"

#define CONTACT_FEET_MAX 4
#define CONTACT_PADDING REAL(-1e3) /* [m] depth of elements that a foot does not have */
#define CONTACT_HALVINGS 6         /* of one Newton step */

/* What a step needs of a material under one element of a foot. */
typedef struct {
    Law law;
    Real recovery;   /* [-] as in Element */
    Real mu;         /* [-] */
    Real k_drift;    /* [N/m^2] */
    Real b_drift;    /* [N s/m] */
    Real exit_drag;  /* [kg/m] */
    Real entry_drag; /* [kg/m] */
    int curves;      /* LawCurve bits of the law */
} ContactMaterial;

/* One foot's sole. */
typedef struct {
    const Real *x; /* [stride] [m] element centres in the foot frame; beyond `elements` 0 */
    const Real *y; /* [stride] [m] */
    Real z;        /* [m] sole plane in the foot frame */
    Real area;     /* [m^2] of an element */
    int elements;
} ContactSole;

/* The same for all robots and steps. */
typedef struct {
    ContactSole sole[CONTACT_FEET_MAX];
    int feet;
    Real dt;        /* [s] */
    Real tolerance; /* [-] of the residual, in the metric of kinetic energy */
    int limit;      /* of Newton steps */
} ContactSetup;

/* What a robot's engine knows before the step; see MildContactInput. */
typedef struct {
    const Real *position;            /* [feet][3] [m] */
    const Real *rotation;            /* [feet][9] [-] */
    const Real *velocity;            /* [feet][6] [m/s, rad/s] */
    const Real *inverse_inertia;     /* [6 feet][6 feet] [1/kg, 1/(kg m), 1/(kg m^2)] */
    const Real *free_velocity;       /* [6 feet] [m/s, rad/s] */
    const ContactMaterial *material; /* [feet] */
    Real height;                     /* [m] of the surface */
} ContactProblem;

/* Numbers of an element's memory, in the order of ElementMemory: memory[number][foot][stride]. */
enum { CONTACT_MEMORY = sizeof(ElementMemory) / sizeof(Real) };

/* What the ground does to a foot, mean over the step. */
typedef struct {
    Real pressure_center[3]; /* [m] world, as in MildFootResult; 0 without load */
    Real depth_max;          /* [m] over the loaded elements */
    Real depth_mean;         /* [m] */
    Real area;               /* [m^2] of the loaded elements */
} ContactFoot;

/* Where a step puts its results. NULL where it may be said: not wanted. */
typedef struct {
    Real *wrench;      /* [feet][6] [N, N m] force and torque on the foot at the reference point */
    Real *velocity;    /* [feet][6] [m/s, rad/s] after the step */
    ContactFoot *foot; /* [feet] or NULL */
    Real *elements;    /* [4][feet][stride] or NULL: depth [m], normal, tangent_x, tangent_y [N] */
    Real *residual;    /* [1] [-] relative, in the metric of kinetic energy */
    int *iterations;   /* [1] Newton steps */
} ContactResult;

#endif
