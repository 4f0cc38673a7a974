/* The elements of a foot that take part in a step, as a structure of arrays.
 *
 * A slot is one listed element. The list is padded to whole vectors. The law of the padding has no
 * force at any depth.
 *
 * Loops over slots use a local copy of Slots. Through a pointer the compiler would have to assume
 * that a store changes the addresses of the arrays; it would reload them and not vectorise. */
#ifndef MILD_GROUND_SLOTS_H
#define MILD_GROUND_SLOTS_H

#include "ground/motion.h"
#include "ground/share.h"

/* Arrays of a foot's slots [padded]. Meaning and symbol are at the field of the same name of
 * Element or ElementMemory. Given here are the unit and the function that writes the array. */
typedef struct {
    /* Where the element is: slots_direct or slots_gather. */
    double *x;     /* [m] centre in the foot frame */
    double *y;     /* [m] */
    double *depth; /* [m] */

    /* Of a surface: faces_gather, faces_laws. Otherwise 0. */
    double *z;     /* [m] above the plane of the foot */
    double *share; /* [-] projected area over pitch^2; 0: carries nothing */

    /* Gradient of the ground under it: slots_uneven; 0 where the foot is not `uneven`. */
    double *slope_x; /* [-] */
    double *slope_y; /* [-] */

    /* Memory before the step: slots_direct or slots_gather; slots_imprints also writes
     * depth_max. */
    double *depth_max;      /* [m] */
    double *last_middle;    /* [m] ElementMemory.middle */
    double *last_speed;     /* [m/s] ElementMemory.front_speed */
    double *drift;          /* [m] */
    double *pending_x;      /* [m] */
    double *pending_y;      /* [m] */
    double *held_x;         /* [N] */
    double *held_y;         /* [N] */
    double *held_stiffness; /* [N/m] */
    double *worn;           /* [-] Share.worn */

    /* Material: slots_materials, when it changes. */
#define SLOT_LAW_ARRAY(name) double *name; /* of Law; slots_resist changes line_stiffness */
    LAW_NUMBERS(SLOT_LAW_ARRAY)
    double *exit_drag;  /* [kg/m] */
    double *entry_drag; /* [kg/m] */
    double *strength;   /* [N/m] line_stiffness before slots_resist changes it */
    double *recovery;   /* [-] */
    double *mu;         /* [-] */
    double *k_drift;    /* [N/m^2] */
    double *b_drift;    /* [N s/m] */

    /* The same of ground with LAW_HEAP: Law.cone_begin and the fields of Share. */
    double *cone_begin;  /* [m] */
    double *projects;    /* [-] */
    double *slip_rate;   /* [1/m] */
    double *regain_rate; /* [1/m] */
    double *grip;        /* [-] */
    double *whole_mu;    /* [-] Share.mu, of which `mu` is what is left in this step */

    /* Share of this step: foot_share; without LAW_HEAP carry is 1. */
    double *lean;  /* [-] */
    double *carry; /* [-] */

    /* Law of this step: slots_begin, changed by slots_resist. */
    double *middle;           /* [m] */
    double *yield_depth;      /* [m] */
    double *virgin_depth;     /* [m] */
    double *unload_stiffness; /* [N/m] */
    double *zero_depth;       /* [m] */
    double *added_mass;       /* [kg] */
    double *front_speed;      /* [m/s] */
    double *yield_speed;      /* [m/s] */
    double *entry_speed;      /* [m/s] also slots_drag */
    double *drift_bound;      /* [N s] */
    double *damping;          /* [kg] */
    double *hold_x;           /* [N s] */
    double *hold_y;           /* [N s] */
    double *hold_stiffness;   /* [kg] */

    /* Only where the foot is `turned`: energy_created; otherwise 0. */
    double *turn_x; /* [m/s] */
    double *turn_y; /* [m/s] */

    /* Only where the foot `stops`: slots_drag, slots_explicit; otherwise 0. */
    double *stop_drag;        /* [kg s/m^2] */
    double *stop_growth;      /* [m] */
    double *explicit_impulse; /* [N s] */

    /* Impulse at the last trial twist, world: contact_pass, sweep_element. */
    double *ix; /* [N s] */
    double *iy; /* [N s] */
    double *iz; /* [N s] */

    /* Minus its derivative with respect to the velocity of the element: contact_pass. On level
     * ground hyx = hxy and hzx = hzy = 0, and these three are not written. */
    double *hxx; /* [kg] */
    double *hxy; /* [kg] */
    double *hxz; /* [kg] */
    double *hyx; /* [kg] */
    double *hyy; /* [kg] */
    double *hyz; /* [kg] */
    double *hzx; /* [kg] */
    double *hzy; /* [kg] */
    double *hzz; /* [kg] */

    /* Working arrays of the solvers. */
    double *bound;       /* [N s] friction bound held by Newton's method: bounds_move */
    double *bound_moved; /* [N s] its last change */
    double *fx;          /* [N s] friction without drift damping: sweep_element */
    double *fy;          /* [N s] */
} Slots;
#define SLOT_ARRAYS (sizeof(Slots) / sizeof(double *))

#define SLOT_LAW_LOAD(name) .name = s->name[i],
/* The element of a slot, by value. The compiler does not load fields that the caller does not
 * use. */
MILD_HD Element slot_element(const Slots *s, int i) {
    return (Element){
        .law = {LAW_NUMBERS(SLOT_LAW_LOAD)},
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
        .mu = s->whole_mu[i],
        .worn = s->worn[i],
        .lean = s->lean[i],
        .carry = s->carry[i],
    };
}

/* The element of a slot for the law of a step. curves: of the ground under the foot. */
MILD_HD Element slot_loaded(const Slots *s, int i, int curves) {
    Element element = slot_element(s, i);
    if (curves & LAW_HEAP) {
        element.law.cone_begin = s->cone_begin[i];
        element_carry(&element, s->carry[i]);
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
MILD_HD void slot_store(const Slots *s, int i, const Element *e) {
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
    double x, y;    /* [m/s] */
    double descent; /* [m/s] */
} SlotVelocity;

/* What a loop over slots has to count with. */
enum {
    SLOT_UNEVEN = 1, /* the ground slopes */
    SLOT_FACES = 2,  /* the elements do not lie in a plane */
};

/* kind: the bits above. It must be a constant in a loop over slots. */
MILD_HD SlotVelocity slot_velocity(const Slots *s, int i, const Motion *motion, int kind) {
    SlotVelocity v;
    v.x = motion_at(motion->x, s->x[i], s->y[i]);
    v.y = motion_at(motion->y, s->x[i], s->y[i]);
    v.descent = -motion_at(motion->z, s->x[i], s->y[i]);
    if (kind & SLOT_FACES) {
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
