/* The contact step of one robot as the work of a warp: what contact.inc needs and gives.
 *
 * Arrays of a robot lie one behind the other, feet first. A foot's elements are dealt to the lanes
 * of its group: element s is the (s / group)-th one of lane s % group. */
#ifndef MILD_BATCH_CONTACT_H
#define MILD_BATCH_CONTACT_H

#include "base/hd.h"
#include "ground/law/begin.h"
#include "ground/law/frame.h"
#include "ground/law/friction.h"
#include "ground/law/impulse.h"
#include "ground/law/motion.h"
#include "ground/law/plate.h"
#include "ground/law/remember.h"
#include "ground/law/rim.h"
#include "ground/terrain/map_view.h"

#define CONTACT_FEET_MAX 4
#define CONTACT_PADDING REAL(-1e3) /* [m] depth of elements that a foot does not have */
#define CONTACT_HALVINGS 6         /* of one Newton step */
#define CONTACT_BEGINS 2           /* Newton steps that begin it, see friction_step */
#define CONTACT_AGAIN 8            /* steps after which it begins again: it may be in a cycle */

/* Bool: the next Newton step is one that begins. */
MILD_HD int contact_begins(int steps, int begins) {
    return (int)((unsigned)steps % CONTACT_AGAIN) < begins;
}

/* What a step needs of a material under one element of a foot. */
typedef struct {
    Law law;
    Real recovery;     /* [-] as in Element */
    Real mu;           /* [-] */
    Real k_drift;      /* [N/m^2] */
    Real b_drift;      /* [N s/m] */
    Real exit_drag;    /* [kg/m] */
    Real entry_drag;   /* [kg/m] */
    Real cohesion;     /* [N/m^2] as in Shear */
    Real shear_length; /* [m] */
    Real projects;     /* [-] as in Share; the next five too */
    Real slip_rate;    /* [1/m] */
    Real regain_rate;  /* [1/m] */
    Real grip;         /* [-] */
    Real growth;       /* [1/m] */
    Real side;         /* [N/m^2] */
    int curves;        /* LawCurve and LawMotion bits of the law */
} ContactMaterial;

/* Where an element is in its sole. */
enum {
    CONTACT_X,     /* [m] centre in the foot frame; beyond the foot's elements 0 */
    CONTACT_Y,     /* [m] */
    CONTACT_BEGIN, /* [-] of SoleHeap; read on ground with LAW_HEAP */
    CONTACT_WIDTH, /* [-] beyond the foot's elements 1 */
    CONTACT_PLACES
};

/* One foot's sole. */
typedef struct {
    const Real *place; /* [CONTACT_PLACES][stride] of its elements */
    Real z;            /* [m] sole plane in the foot frame */
    Real area;         /* [m^2] of an element */
    int elements;
} ContactSole;

/* The same for all robots and steps. */
typedef struct {
    ContactSole sole[CONTACT_FEET_MAX];
    int feet;
    int soles;      /* of the arrays of a robot, in which feet are first */
    int groups;     /* as in BatchShape; this and the next two only where the size is no constant */
    int lanes;      /* of a group */
    int per;        /* elements of a lane */
    Real dt;        /* [s] */
    Real tolerance; /* [-] of the residual, in the metric of kinetic energy */
    int limit;      /* of Newton steps */
    int begins;     /* of these; CONTACT_BEGINS */
    int triangle;   /* bool: inverse_inertia is its lower triangle, row by row */
    MapView map;    /* in a version with CONTACT_MAP */
} ContactSetup;

/* Place of an entry of a lower triangle. */
MILD_HD int contact_triangle(int row, int column) {
    return row * (row + 1) / 2 + column;
}

/* The point (0, 0, z) of a foot's sole plane, then its x and y axes, world. R: rotation of it. */
MILD_HD void contact_arms(const ContactSole *sole, const Real *R, Real arm[3][3]) {
    LANE_UNROLL
    for (int i = 0; i < 3; i++) {
        arm[0][i] = R[3 * i + 2] * sole->z;
        arm[1][i] = R[3 * i];
        arm[2][i] = R[3 * i + 1];
    }
}

/* What a robot's engine knows before the step; see MildContactInput. */
typedef struct {
    const Real *position;            /* [feet][3] [m] */
    const Real *rotation;            /* [feet][9] [-] */
    const Real *velocity;            /* [feet][6] [m/s, rad/s] */
    const Real *inverse_inertia;     /* [6 soles][6 soles] [1/kg, 1/(kg m), 1/(kg m^2)], or with
                                        ContactSetup.triangle [contact_triangle(6 feet, 0)] */
    const Real *free_velocity;       /* [6 feet] [m/s, rad/s] */
    const ContactMaterial *material; /* [feet] without a map */
    Real height;                     /* [m] of the surface */
    /* With a map. */
    const ContactMaterial *table; /* [materials + 1][feet]; the last is no material */
    const int *label_material;    /* [labels] index of a label's material; NULL: 0 */
    int materials;
    const Real *map_origin; /* [2] [m] world; NULL: 0 */
} ContactProblem;

/* Memory of a robot: CONTACT_MEMORY numbers of each element, those of ElementMemory, as
 * [number][foot][stride]. The two of `pending` are a pair (base/hd.h): neither exceeds
 * REMEMBER_BAND, of which a step rounds off at most 2^-16, 0.15 nm. So d_D is wrong by at most
 * 0.22 nm for each step since touchdown, 0.9 um after 20 s of 5 ms.
 *
 * With a map four more of each follow: number `plane` [m] and the gradient [-] along x and y of the
 * plane that the last step had for the ground, and the label that a loaded element touched down on.
 * The depth below this plane at the way r [m] from where the foot's reference point was is plane +
 * gradient . (r_x, r_y) - r_z. Then [5][foot] follow: x, y and z of that point and the height of
 * the ground [m], and whether there was a step, 1 or 0. */
enum {
    CONTACT_MEMORY = sizeof(ElementMemory) / sizeof(Real) - 1,
    CONTACT_MAP_MEMORY = CONTACT_MEMORY + 4,
    CONTACT_FOOT_MEMORY = LANES /* numbers that [5][foot] have room in */
};
#define CONTACT_NO_PLANE                                                                           \
    REAL(1e6) /* [m] `plane` of an element that was not there in the last step */

typedef struct {
    Real *numbers;
    Real *worn; /* [foot][stride] [-] wear of the elements (share.h); NULL: no material wears */
} ContactMemory;

/* [numbers] of the memory of a robot with room for `elements` elements. map: bool. */
MILD_HD int contact_memory_numbers(int elements, int map) {
    return map ? elements * CONTACT_MAP_MEMORY + CONTACT_FOOT_MEMORY : elements * CONTACT_MEMORY;
}

/* What an element remembers, as it lies in memory. */
typedef struct {
    Real number[CONTACT_MEMORY];
} ContactKept;

/* at: its first number, those after it `next` apart each. */
MILD_HD ContactKept contact_kept(const Real *at, int next) {
    ContactKept kept;
    for (int n = 0; n < CONTACT_MEMORY; n++) {
        kept.number[n] = at[n * next];
    }
    return kept;
}

MILD_HD ElementMemory contact_unpack(const ContactKept *kept) {
    const Real *at = kept->number;
    ElementMemory before;
    before.depth_max = at[0];
    before.middle = at[1];
    before.front_speed = at[2];
    before.drift = at[3];
    pair_unpack(at[4], &before.pending_x, &before.pending_y);
    before.pending_x *= REMEMBER_BAND;
    before.pending_y *= REMEMBER_BAND;
    before.held_x = at[5];
    before.held_y = at[6];
    before.held_stiffness = at[7];
    return before;
}

/* What an element remembers. */
MILD_HD ElementMemory contact_recall(const Real *at, int next) {
    const ContactKept kept = contact_kept(at, next);
    return contact_unpack(&kept);
}

MILD_HD void contact_record(Real *at, int next, const ElementMemory *after) {
    at[0] = after->depth_max;
    at[next] = after->middle;
    at[2 * next] = after->front_speed;
    at[3 * next] = after->drift;
    at[4 * next] =
        pair_pack(after->pending_x * (1 / REMEMBER_BAND), after->pending_y * (1 / REMEMBER_BAND));
    at[5 * next] = after->held_x;
    at[6 * next] = after->held_y;
    at[7 * next] = after->held_stiffness;
}

/* What a step knows of an element besides its material, in parts of four numbers, each of which a
 * lane reads at once. The numbers are those of Element. */
#define CONTACT_PART __attribute__((aligned(4 * sizeof(Real))))
typedef struct {
    Real depth, middle, yield_depth, zero_depth;
} CONTACT_PART ContactPath;
typedef struct {
    Real unload_stiffness, added_mass, front_speed;
    Real last; /* yield_speed; where elements have a share alone, its q [-] */
} CONTACT_PART ContactFront;
typedef struct {
    Real entry_speed, stop_drag, stop_growth;
    Real last; /* explicit_impulse; where elements have a share alone, their mu [-] */
} CONTACT_PART ContactStop;
typedef struct {
    Real hold_x, hold_y, hold_stiffness, drift_bound;
} CONTACT_PART ContactHold;
typedef struct {
    Real slope_x, slope_y; /* [-] gradient of the ground under the element */
    Real material, label;  /* whole numbers */
} CONTACT_PART ContactSurface;
typedef struct {
    Real mu, line_stiffness, virgin_depth; /* as its motion so far has made them */
    Real share;                            /* [-] q of Share */
} CONTACT_PART ContactOwnLaw;

/* What an element carries of its load in this step, of Share. */
typedef struct {
    Real share, lean; /* [-] q and lean of Share */
} ContactLoad;

/* Velocity of an element, of a sole along the axes of its frame (frame.h). descent: speed at which
 * it penetrates. */
typedef struct {
    Real x, y;    /* [m/s] */
    Real descent; /* [m/s] */
} ContactVelocity;

/* Gives an element its material. */
MILD_HD void contact_stand_on(const ContactMaterial *material, Element *e) {
    e->law = material->law;
    e->recovery = material->recovery;
    e->mu = material->mu;
    e->k_drift = material->k_drift;
    e->b_drift = material->b_drift;
    e->exit_drag = material->exit_drag;
    e->entry_drag = material->entry_drag;
}

/* [-] Cosine between a sole and the ground, at least SHARE_LEAN; slots_lean. normal: of the sole,
 * world. x, y: gradient of the ground. */
MILD_HD Real contact_lean(const Real normal[3], Real x, Real y) {
    const Real side = normal[2] < 0 ? -1 : 1; /* the face that looks down */
    const Real along = side * (normal[2] - x * normal[0] - y * normal[1]);
    return real_min(real_max(along / REAL_SQRT(1 + x * x + y * y), SHARE_LEAN), 1);
}

/* The share of an element before the step. plane: bool, of a sole; else of a shell, which has no
 * ground at its sides. */
MILD_HD Share contact_share(const ContactMaterial *material, int plane, Real worn) {
    const Share share = {material->projects,
                         material->slip_rate,
                         material->regain_rate,
                         material->grip,
                         material->growth,
                         plane ? material->side : 0,
                         material->mu,
                         worn,
                         1,
                         1};
    return share;
}

/* Adapts an element to its motion at the start of the step, after element_begin. rotation: [9] of
 * the foot. area: [m^2] of the element. */
MILD_HD void contact_direct(const ContactMaterial *material, const Real *rotation, Real area,
                            const ContactVelocity *now, Real dt, const ElementMemory *memory,
                            Element *e) {
    const int curves = material->curves;
    if (curves & LAW_RESIST) {
        const Plate plate = plate_of(rotation);
        element_resist(e, memory, &plate, (curves & LAW_SPACE) != 0, curves, dt, 1 / dt,
                       material->law.line_stiffness, now->x, now->y, now->descent);
        /* Not before `middle`, where float may round it to: on a way of no length the force would
         * be infinite. The code in double is that of mild/ground.h. */
        if (sizeof(Real) < sizeof(double)) {
            e->yield_depth = real_max(e->yield_depth, e->middle);
        }
    }
    if (curves & LAW_SHEAR) {
        const Shear shear = {material->mu, material->cohesion, material->shear_length, area};
        element_shear(e, memory, &shear, curves, dt, 1 / dt);
    }
}

/* A rotation has no larger entry; more than 1 for rounding. */
#define CONTACT_TURN REAL(2)

/* 0, or NaN where number k of a foot's pose and motion, 0 .. 8, is none or turns nothing. */
MILD_HD Real contact_blank(const Real *position, const Real *rotation, const Real *velocity,
                           const Real *free_velocity, int k) {
    Real sum = rotation[k] + (k < 3 ? position[k] : 0);
    sum += k < 6 ? velocity[k] + free_velocity[k] : 0;
    return REAL_ABS(rotation[k]) <= CONTACT_TURN ? 0 * sum : REAL(NAN);
}

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
    Real *residual;    /* [1] [-] relative, in the metric of kinetic energy; NaN: see is_number */
    int *iterations;   /* [1] Newton steps */
} ContactResult;

/* The step of one robot on the CPU (host.inc): a version of contact.inc in each unit, since they
 * take long to compile. */
typedef void HostRobot(const ContactSetup *setup, const ContactProblem *problem,
                       const ContactMemory *memory, int advance, const ContactResult *result);
HostRobot host_feet, host_points, host_feet_map, host_points_map; /* in float */

#endif
