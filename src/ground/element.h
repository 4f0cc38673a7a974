/* One element of a sole in one contact step (docs/model.md section 6).
 *
 * A step of an element is three pure functions, in this order:
 *
 *     element_begin      begin.h      what does not depend on the new velocity
 *     element_impulse    impulse.h    normal impulse at a trial velocity, as often as asked
 *     friction_impulse   friction.h   tangential impulse there
 *     element_remember   remember.h   memory at the end of the step
 *
 * docs/model.md calls the yield depth a, depths in the middle of a step m, speeds w (down). */
#ifndef MILD_GROUND_ELEMENT_H
#define MILD_GROUND_ELEMENT_H

#include "ground/law.h"

#define ELEMENT_TINY REAL(1e-30) /* keeps a quotient finite where both of its parts are 0 */
#define ELEMENT_ELASTIC                                                                            \
    REAL(1e-4)                 /* [m] least elastic travel: plastic ground is elastic that far */
#define ELEMENT_LAG REAL(5e-3) /* [s] by which the force of elastic ground follows the motion */

/* What an element remembers from one step to the next (section 5). All 0: it carries nothing. */
typedef struct {
    Real depth_max;      /* u_max [m] greatest depth since it touched down */
    Real middle;         /* [m] depth in the middle of the last step; 0: take it from the speed */
    Real front_speed;    /* [m/s] of the added mass while the element leads the front, else 0 */
    Real drift;          /* d_D [m] length of the horizontal path                      section 8 */
    Real pending_x;      /* [m] horizontal motion not yet counted into d_D             section 8 */
    Real pending_y;      /* [m] */
    Real held_x;         /* f [N] that friction holds                                  section 6 */
    Real held_y;         /* [N] */
    Real held_stiffness; /* k [N/m] of friction when it was held */
} ElementMemory;

typedef struct {
    /* Material where it touched down. */
    Law law;       /* of virgin ground */
    Real recovery; /* [-] share of the depth that springs back */
    Real mu;       /* [-] friction coefficient */
    Real k_drift;  /* k_D [N/m^2] drift stiffness                                       eq 14 */
    Real b_drift;  /* b_D [N s/m] drift damping                                         eq 14 */

    /* Way of the step, downward: from `middle` to depth + dt w/2. */
    Real depth;  /* u0 [m] below the undisturbed surface at the start of the step */
    Real middle; /* m0 [m] depth in the middle of the step before */

    /* Unloading line (section 5). */
    Real yield_depth;      /* a [m] deepest so far: beyond it the ground is virgin */
    Real virgin_depth;     /* b [m] depth at which the law is read there; a but in section 19 */
    Real unload_stiffness; /* [N/m] slope of the line */
    Real zero_depth;       /* [m] where the line carries nothing */

    /* Added mass. */
    Real added_mass;  /* m_a(a) [kg] */
    Real front_speed; /* w_a [m/s] of the added mass, at the front */
    Real yield_speed; /* [m/s] new speed with which the way ends at the yield depth */

    /* Recruited mass and drag: of the recruited depth times a speed. */
    Real entry_speed;      /* h [m/s] at which the element gets to virgin ground */
    Real exit_drag;        /* [kg/m] by the new speed */
    Real entry_drag;       /* [kg/m] by the entry speed */
    Real stop_drag;        /* [kg s/m^2] by the square of the lost speed: it stops in the step */
    Real stop_growth;      /* [m] recruited up to u0, where the foot turns round */
    Real explicit_impulse; /* [N s] of parameters that create energy */

    /* Friction (section 6). */
    Real drift_bound;    /* dt k_D d_D u [N s] the drift's share of the bound */
    Real damping;        /* dt b_D [kg] */
    Real hold_x;         /* dt f [N s] held at the start of the step */
    Real hold_y;         /* [N s] */
    Real hold_stiffness; /* dt^2 k [kg] */
    Real turn_x; /* [m/s] friction begins at minus this velocity, see energy.c; 0: at rest */
    Real turn_y; /* [m/s] */
} Element;

#endif
