/* One element of a sole in one contact step (docs/model.md section 6).
 * A step of an element calls these functions in this order, which write to the element and its
 * memory alone:
 *
 *     element_begin      begin.h      everything that does not depend on the new velocity
 *     element_explicit, element_drag  impulses that depend on the motion before the step alone
 *     element_resist     plate.h      a law that depends on the direction of motion
 *     element_shear      friction.h   friction that builds up with slip
 *     element_impulse    impulse.h    normal impulse at a trial velocity, any number of times
 *     friction_impulse   friction.h   tangential impulse at the same velocity
 *     element_remember   remember.h   memory at the end of the step
 *     element_sunk       remember.h   the same, deepened by its frame
 *     element_peak       remember.h   the greatest depth within the step
 *
 * In docs/model.md a is the yield depth, m a depth in the middle of a step, w a downward speed. */
#ifndef MILD_GROUND_ELEMENT_H
#define MILD_GROUND_ELEMENT_H

#include "ground/law/law.h"

#define ELEMENT_TINY REAL(1e-30)   /* keeps a quotient finite where both of its parts are 0 */
#define ELEMENT_ELASTIC REAL(1e-4) /* [m] smallest elastic travel, also of plastic ground */
#define ELEMENT_LAG REAL(5e-3)     /* [s] delay of the force of elastic ground */

/* What an element remembers from one step to the next (section 5). All 0 for an unloaded
 * element. */
typedef struct {
    Real depth_max;      /* u_max [m] greatest depth since it touched down */
    Real middle;         /* [m] depth in the middle of the last step; 0: unknown, use the speed */
    Real front_speed;    /* [m/s] of the added mass while the element is at the front, else 0 */
    Real drift;          /* d_D [m] length of the horizontal path                      section 8 */
    Real pending_x;      /* [m] horizontal motion not yet counted into d_D             section 8 */
    Real pending_y;      /* [m] */
    Real held_x;         /* f [N] spring force of friction                             section 6 */
    Real held_y;         /* [N] */
    Real held_stiffness; /* k [N/m] stiffness of that spring */
} ElementMemory;

typedef struct {
    /* Material that the element touched down on. */
    Law law;       /* of virgin ground */
    Real recovery; /* [-] share of the depth that springs back */
    Real mu;       /* [-] friction coefficient */
    Real k_drift;  /* k_D [N/m^2] drift stiffness                                       eq 14 */
    Real b_drift;  /* b_D [N s/m] drift damping                                         eq 14 */

    /* Way of the step: from the depth `middle` to depth + dt w/2. */
    Real depth;  /* u0 [m] below the undisturbed surface at the start of the step */
    Real middle; /* m0 [m] depth in the middle of the step before */

    /* Unloading line (section 5). */
    Real yield_depth;      /* a [m] deepest so far: beyond it the ground is virgin */
    Real virgin_depth;     /* b [m] depth at which virgin ground is evaluated there; b = a except
                              in section 19 */
    Real unload_stiffness; /* [N/m] slope of the line */
    Real zero_depth;       /* [m] depth at which the line reaches zero force */

    /* Added mass. */
    Real added_mass;  /* m_a(a) [kg] */
    Real front_speed; /* w_a [m/s] of the added mass, which is at the front */
    Real yield_speed; /* w_y [m/s] new speed at which the way ends at the yield depth */

    /* Recruited mass and drag. The drags are coefficients of the recruited depth times ... */
    Real entry_speed;      /* h [m/s] at which the element reaches virgin ground */
    Real exit_drag;        /* [kg/m] ... the new speed */
    Real entry_drag;       /* [kg/m] ... the entry speed */
    Real stop_drag;        /* [kg s/m^2] ... the square of the speed lost in the step */
    Real stop_growth;      /* [m] recruited depth up to u0, for an element that reverses */
    Real explicit_impulse; /* [N s] from parameters that create energy */

    /* Friction (section 6). */
    Real drift_bound;    /* dt k_D d_D u [N s] part of the bound due to drift */
    Real damping;        /* dt b_D [kg] drift damping */
    Real hold_x;         /* dt f [N s] spring force at the start of the step */
    Real hold_y;         /* [N s] */
    Real hold_stiffness; /* dt^2 k [kg] */
    Real turn_x;         /* [m/s] reversal velocity: friction starts at minus this (energy.c) */
    Real turn_y;         /* [m/s] */
} Element;

#endif
