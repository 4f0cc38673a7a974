/* The elements of a foot that take part in a step, in blocks of a vector each.
 *
 * A slot is one listed element: lane i % SLOT_LANES of block i / SLOT_LANES. The list is padded to
 * whole blocks. The law of the padding has no force at any depth.
 *
 * A loop over blocks has a loop over lanes inside, which is one vector. All numbers of a block lie
 * at constant distances, so one address serves them all.
 *
 * With MILD_REAL_FLOAT a block has twice as many slots (src/robot/float). */
#ifndef MILD_GROUND_SLOTS_H
#define MILD_GROUND_SLOTS_H

#include "ground/law/motion.h"
#include "ground/law/share.h"

/* Lanes of a vector. MILD_WIDEST_VECTORS: the compiler takes the widest that there are
 * (src/CMakeLists.txt). */
#if defined(__AVX512F__) && defined(MILD_WIDEST_VECTORS)
#define SLOT_BYTES 64
#elif defined(__AVX__)
#define SLOT_BYTES 32
#else
#define SLOT_BYTES 16
#endif
#define SLOT_LANES (SLOT_BYTES / (int)sizeof(Real))

typedef Real Lanes[SLOT_LANES];

/* A block of slots. Meaning and symbol are at the field of the same name of Element or
 * ElementMemory. Given here are the unit and the function that writes the numbers. */
typedef struct {
    /* Where the element is: slots_gather. */
    Lanes x;     /* [m] centre in the foot frame */
    Lanes y;     /* [m] */
    Lanes depth; /* [m] */

    /* Of a shell: shell_gather, shell_laws. Otherwise 0. */
    Lanes z;          /* [m] above the plane of the foot */
    Lanes area_share; /* [-] projected area over pitch^2; 0: carries nothing */

    /* Gradient of the ground under it: slots_uneven; 0 where the foot is not `uneven`. */
    Lanes slope_x; /* [-] */
    Lanes slope_y; /* [-] */

    /* Memory before the step: slots_gather; slots_imprints also writes depth_max. */
    Lanes depth_max;      /* [m] */
    Lanes last_middle;    /* [m] ElementMemory.middle */
    Lanes last_speed;     /* [m/s] ElementMemory.front_speed */
    Lanes drift;          /* [m] */
    Lanes pending_x;      /* [m] */
    Lanes pending_y;      /* [m] */
    Lanes held_x;         /* [N] */
    Lanes held_y;         /* [N] */
    Lanes held_stiffness; /* [N/m] */
    Lanes worn;           /* [-] Share.worn */

    /* Material: slots_materials, when it changes. */
#define SLOT_LAW_LANES(name) Lanes name; /* of Law; slots_resist changes line_stiffness */
    LAW_NUMBERS(SLOT_LAW_LANES)
    Lanes exit_drag;  /* [kg/m] */
    Lanes entry_drag; /* [kg/m] */
    Lanes strength;   /* [N/m] line_stiffness before slots_resist changes it */
    Lanes recovery;   /* [-] */
    Lanes mu;         /* [-] */
    Lanes k_drift;    /* [N/m^2] */
    Lanes b_drift;    /* [N s/m] */

    /* The same of ground with LAW_HEAP: Law.cone_begin and the fields of Share. */
    Lanes cone_begin;  /* [m] */
    Lanes projects;    /* [-] */
    Lanes slip_rate;   /* [1/m] */
    Lanes regain_rate; /* [1/m] */
    Lanes grip;        /* [-] */
    Lanes growth;      /* [1/m] */
    Lanes side;        /* [N/m^2] */
    Lanes whole_mu;    /* [-] Share.mu, of which `mu` is what is left in this step */

    /* Of a shell on ground with LAW_HEAP: shell_lean. Otherwise 0. */
    Lanes ahead; /* [N] share_ahead */

    /* Share of this step: foot_carry; without LAW_HEAP share is 1. */
    Lanes lean;  /* [-] */
    Lanes share; /* [-] Share.q */

    /* Law of this step: slots_begin, changed by slots_resist. */
    Lanes middle;           /* [m] */
    Lanes yield_depth;      /* [m] */
    Lanes virgin_depth;     /* [m] */
    Lanes unload_stiffness; /* [N/m] */
    Lanes zero_depth;       /* [m] */
    Lanes added_mass;       /* [kg] */
    Lanes front_speed;      /* [m/s] */
    Lanes yield_speed;      /* [m/s] */
    Lanes entry_speed;      /* [m/s] also slots_drag */
    Lanes drift_bound;      /* [N s] */
    Lanes damping;          /* [kg] */
    Lanes hold_x;           /* [N s] */
    Lanes hold_y;           /* [N s] */
    Lanes hold_stiffness;   /* [kg] */

    /* Only where the foot is `turned`: energy_created; otherwise 0. */
    Lanes turn_x; /* [m/s] */
    Lanes turn_y; /* [m/s] */

    /* Only where the foot `stops`: slots_drag, slots_explicit; otherwise 0. */
    Lanes stop_drag;        /* [kg s/m^2] */
    Lanes stop_growth;      /* [m] */
    Lanes explicit_impulse; /* [N s] */

    /* Powers at the last trial twist: contact_pass. */
    Lanes power[2];   /* ImpulsePowers.virgin */
    Lanes elastic[2]; /* ImpulsePowers.elastic */

    /* Impulse at the last trial twist, world: contact_pass, sweep_element. */
    Lanes ix; /* [N s] */
    Lanes iy; /* [N s] */
    Lanes iz; /* [N s] */

    /* Minus its derivative with respect to the velocity of the element: contact_pass. On level
     * ground hyx = hxy and hzx = hzy = 0, and these three are not written. */
    Lanes hxx; /* [kg] */
    Lanes hxy; /* [kg] */
    Lanes hxz; /* [kg] */
    Lanes hyx; /* [kg] */
    Lanes hyy; /* [kg] */
    Lanes hyz; /* [kg] */
    Lanes hzx; /* [kg] */
    Lanes hzy; /* [kg] */
    Lanes hzz; /* [kg] */

    /* Working arrays of the solvers. */
    Lanes bound;       /* [N s] friction bound held by Newton's method: bounds_begin, bounds_move */
    Lanes bound_moved; /* [N s] its last change */
    Lanes fx;          /* [N s] friction without drift damping: sweep_element; [N] slots_elastic */
    Lanes fy;          /* [N s] */
} Slots;
#define SLOT_NUMBERS (sizeof(Slots) / sizeof(Lanes))

/* The lanes of one number in a register, for sums over all blocks. */
typedef Real LaneVector __attribute__((vector_size(sizeof(Lanes)), may_alias));

MILD_HD LaneVector lanes_load(const Real *lanes) {
    return *(const LaneVector *)lanes;
}

#define SLOT_LAW_LOAD(name) .name = s->name[i],
/* The element of lane i of a block, by value. The compiler does not load fields that the caller
 * does not use. */
MILD_HD Element slot_element(const Slots *s, int i) {
    return (Element){
        .law = {LAW_NUMBERS(SLOT_LAW_LOAD).cone_begin = 0},
        .recovery = s->recovery[i],
        .mu = s->mu[i],
        .k_drift = s->k_drift[i],
        .b_drift = s->b_drift[i],
        .depth = s->depth[i],
        .middle = s->middle[i],
        .yield_depth = s->yield_depth[i],
        .virgin_depth = s->virgin_depth[i],
        .unload_stiffness = s->unload_stiffness[i],
        .zero_depth = s->zero_depth[i],
        .added_mass = s->added_mass[i],
        .front_speed = s->front_speed[i],
        .yield_speed = s->yield_speed[i],
        .entry_speed = s->entry_speed[i],
        .exit_drag = s->exit_drag[i],
        .entry_drag = s->entry_drag[i],
        .stop_drag = s->stop_drag[i],
        .stop_growth = s->stop_growth[i],
        .explicit_impulse = s->explicit_impulse[i],
        .drift_bound = s->drift_bound[i],
        .damping = s->damping[i],
        .hold_x = s->hold_x[i],
        .hold_y = s->hold_y[i],
        .hold_stiffness = s->hold_stiffness[i],
        .turn_x = s->turn_x[i],
        .turn_y = s->turn_y[i],
    };
}

/* The share of a slot. */
MILD_HD Share slot_share(const Slots *s, int i) {
    return (Share){
        .projects = s->projects[i],
        .slip_rate = s->slip_rate[i],
        .regain_rate = s->regain_rate[i],
        .grip = s->grip[i],
        .growth = s->growth[i],
        .side = s->side[i],
        .mu = s->whole_mu[i],
        .worn = s->worn[i],
        .lean = s->lean[i],
        .q = s->share[i],
    };
}

/* The element of a slot for the law of a step. curves: of the ground under the foot. */
MILD_HD Element slot_loaded(const Slots *s, int i, int curves) {
    Element element = slot_element(s, i);
    if (curves & LAW_HEAP) {
        element.law.cone_begin = s->cone_begin[i];
        element_share_virgin(&element, s->share[i]);
    }
    return element;
}

/* What the element of a slot remembers. */
MILD_HD ElementMemory slot_memory(const Slots *s, int i) {
    return (ElementMemory){
        .depth_max = s->depth_max[i],
        .middle = s->last_middle[i],
        .front_speed = s->last_speed[i],
        .drift = s->drift[i],
        .pending_x = s->pending_x[i],
        .pending_y = s->pending_y[i],
        .held_x = s->held_x[i],
        .held_y = s->held_y[i],
        .held_stiffness = s->held_stiffness[i],
    };
}

/* Stores the fields that element_begin sets. */
MILD_HD void slot_store(Slots *s, int i, const Element *e) {
    s->middle[i] = e->middle;
    s->yield_depth[i] = e->yield_depth;
    s->virgin_depth[i] = e->virgin_depth;
    s->unload_stiffness[i] = e->unload_stiffness;
    s->zero_depth[i] = e->zero_depth;
    s->added_mass[i] = e->added_mass;
    s->front_speed[i] = e->front_speed;
    s->yield_speed[i] = e->yield_speed;
    s->entry_speed[i] = e->entry_speed;
    s->drift_bound[i] = e->drift_bound;
    s->damping[i] = e->damping;
    s->hold_x[i] = e->hold_x;
    s->hold_y[i] = e->hold_y;
    s->hold_stiffness[i] = e->hold_stiffness;
}

/* Velocity of a slot's element, x and y along the world's axes. `descent` is the speed w at which
 * its depth u = h0(x, y) - z grows: w = slope . v_xy - v_z. */
typedef struct {
    Real x, y;    /* [m/s] */
    Real descent; /* [m/s] */
} SlotVelocity;

/* What a loop over slots has to count with. */
enum {
    SLOT_UNEVEN = 1, /* the ground slopes */
    SLOT_SHELL = 2,  /* the elements do not lie in a plane */
};

/* kind: the bits above. It must be a constant in a loop over slots. */
MILD_HD SlotVelocity slot_velocity(const Slots *s, int i, const Motion *motion, int kind) {
    SlotVelocity v;
    v.x = motion_at(motion->x, s->x[i], s->y[i]);
    v.y = motion_at(motion->y, s->x[i], s->y[i]);
    v.descent = -motion_at(motion->z, s->x[i], s->y[i]);
    if (kind & SLOT_SHELL) {
        v.x += motion->lift[0] * s->z[i];
        v.y += motion->lift[1] * s->z[i];
        v.descent -= motion->lift[2] * s->z[i];
    }
    if (kind & SLOT_UNEVEN) {
        v.descent += s->slope_x[i] * v.x + s->slope_y[i] * v.y;
    }
    return v;
}

/* Bool: the resistance of a slot depends on its direction, by resistive force theory: no other
 * curve is blended with it. */
MILD_HD int slot_directed(const Slots *s, int i) {
    return s->flat_stiffness[i] == 0.0 && s->power_force[i] == 0.0;
}

#endif
