/* The contact step of one robot whose shells are near the ground, by a team: any number of bodies,
 * soles and shells (docs/model.md section 20), level or on a map.
 *
 * Few robots take this step at a time, so it has one text for all sizes. Elements that may touch
 * are listed, and dealt to warps in rounds of one body each; those of a warp's first rounds are
 * kept (BODIES_REST), and others follow from their memory whenever they are asked for. What the
 * lanes share is in BodiesWork. The method is that of contact.inc, and so are the names. */
#ifndef MILD_BATCH_BODIES_H
#define MILD_BATCH_BODIES_H

#include "base/hd.h"
#include "ground/batch/contact.h"

#define BODIES_MAX 13 /* feet, and bodies with shells: those of the Go1 */
#ifndef BODIES_NEAR
#define BODIES_NEAR BODIES_MAX /* of them near the ground; an includer may have its own */
#endif
#define BODIES_ROWS (6 * BODIES_NEAR)
#define BODIES_ELEMENTS 1536 /* of all bodies */
#define BODIES_ROUNDS (BODIES_ELEMENTS / LANES + BODIES_NEAR)
#define BODIES_SUMS 42             /* of an evaluation: a wrench and a 6 x 6 hessian */
#define BODIES_MARGIN REAL(1e-3)   /* [m] as in locate.c */
#define BODIES_EXTRA_SPEED REAL(2) /* [m/s] as in locate.c */
#define BODIES_GAIN REAL(0.5)      /* [m/s] of bodies_touch */
#define BODIES_ABOVE REAL(1e-4)    /* [m] of bodies_touch, for rounding */
#define BODIES_GROWTH REAL(8)      /* [-] as NEWTON_GROWTH in newton_step.c */
#define BODIES_COLUMNS 8           /* of a warp that are eliminated at once */

/* The elements of a body. */
typedef struct {
    const Real *x;     /* [elements] [m] centre in the body's frame */
    const Real *y;     /* [m] */
    const Real *begin; /* [-] a sole: of SoleHeap; a shell: NULL */
    const Real *width; /* [-] */
    const Real *face;  /* a sole: NULL; a shell: [5][elements] z [m], outward normal, area over
                         `square` */
    Real z;            /* [m] of a sole's plane */
    Real breadth;      /* [-] of a shell: width of SoleHeap */
    Real square;       /* [m^2] area of an element in the law */
    Real middle[3];    /* [m] of the bounding box, body's frame */
    Real half[3];      /* [m] */
    Real radius;       /* [m] of the body's origin to the farthest element */
    int elements;
    const ContactMaterial *table; /* material m at [m step] */
    int step;
    int memory; /* a shell: where its memory begins in that of a robot */
} BodiesSole;

/* The same for all robots and steps: feet first. */
typedef struct BodiesSetup {
    BodiesSole sole[BODIES_MAX];
    int feet;
    int bodies;
    Real dt;        /* [s] */
    Real tolerance; /* as in ContactSetup */
    int limit;
    int materials; /* in the tables; behind them one that is not a number */
    Real steepest; /* [-] upper bound on the gradient of the map */
    int has_map;   /* bool */
    MapView map;
} BodiesSetup;

/* Memory of a body. Number n of element s is at element[n next + s]: CONTACT_MEMORY numbers, then
 * plane [m], its gradient [-] along x and y, a label, as in contact.h; of a shell the last is the
 * state and the area's share [-] follows. Numbers of the body are `step` apart: the reference point
 * and height of the last step [m], whether there was a step; of a shell then whether anything is
 * remembered. */
typedef struct {
    Real *element;
    int next;
    Real *body;
    int step;
    Real *worn; /* [-] as in ContactMemory */
} BodiesMemory;
enum {
    BODIES_PLANE = CONTACT_MEMORY, /* with a map, or of a shell */
    BODIES_STATE = BODIES_PLANE + 3,
    BODIES_AREA_SHARE,
    BODIES_NUMBERS,     /* of an element of a shell */
    BODIES_STEPPED = 4, /* of the numbers of a body */
    BODIES_TOUCHED,
    BODIES_OWN = 8 /* numbers of a body */
};
/* State of an element of a shell: 1 plus the label that it touched down on, or one of these: the
 * MATERIAL_NONE, MATERIAL_FREE and MATERIAL_BURIED of ground/step/state.h. */
enum { BODIES_NONE = 0, BODIES_FREE = -1, BODIES_BURIED = -2 };

/* [numbers] of the memory of a shell. worn: bool, with wear. */
MILD_HD int bodies_memory_numbers(int elements, int worn) {
    return (BODIES_NUMBERS + (worn != 0)) * elements + BODIES_OWN;
}

/* That of foot f in the memory of a robot, in the layout of contact.h. worn: that of the robot, or
 * NULL. */
MILD_HD BodiesMemory bodies_foot_memory(Real *memory, Real *worn, int groups, int stride, int f) {
    const int all = groups * stride;
    const BodiesMemory at = {memory + f * stride, all, memory + all * CONTACT_MAP_MEMORY + f,
                             groups, worn ? worn + f * stride : NULL};
    return at;
}

/* That of a shell, at `memory`. */
MILD_HD BodiesMemory bodies_memory(Real *memory, int elements, int worn) {
    Real *own = memory + BODIES_NUMBERS * elements;
    const BodiesMemory at = {memory, elements, own, 1, worn ? own + BODIES_OWN : NULL};
    return at;
}

/* A point of the search. */
typedef struct {
    Real impulse[BODIES_ROWS]; /* [N s, N m s] P */
    Real twist[BODIES_ROWS];   /* [m/s, rad/s] V */
    Real wrench[BODIES_ROWS];  /* [N s, N m s] W */
} BodiesPoint;

/* A robot in a step, in shared memory: its feet, then its bodies near the ground. In: all up to
 * `inverse_inertia`. Out: wrench [N, N m], velocity after the step, foot. */
typedef struct {
    int count;
    int body[BODIES_NEAR]; /* number of a place */
    BodiesMemory memory[BODIES_NEAR];
    const int *label_material; /* as in ContactProblem */
    const Real *map_origin;
    Real height; /* [m] of the surface */
    Real position[BODIES_NEAR][3];
    Real rotation[BODIES_NEAR][9];
    Real velocity[BODIES_NEAR][6];
    Real free_velocity[BODIES_ROWS];
    Real inverse_inertia[BODIES_ROWS * BODIES_ROWS]; /* [6 count][6 count] */
    Real wrench[BODIES_ROWS];
    ContactFoot foot[BODIES_NEAR];
    Real residual; /* [-] relative; NaN: problem or results are no numbers, the memory stays */
    int iterations;
    /* ---- of the solution ---- */
    Real least[BODIES_NEAR];        /* [m] elements less deep do not touch in this step */
    int listed[BODIES_NEAR];        /* elements in the list, which begins at */
    int begin[BODIES_NEAR];         /* for each place */
    int first[BODIES_NEAR + 1];     /* round of a place; those of a place follow each other */
    uint8_t place[BODIES_ROUNDS];   /* of a round */
    uint16_t list[BODIES_ELEMENTS]; /* numbers of elements */
    Real frame[BODIES_NEAR][3];     /* [-] axes of the frames in which soles press; 0: of a shell */
    Rim rim[BODIES_NEAR];           /* of shells with listed elements, on ground with LAW_HEAP */
    int active; /* rows of bodies with listed elements; P and W of others are 0 */
    uint8_t active_row[BODIES_ROWS];
    Real part[BODIES_ROUNDS][BODIES_SUMS];
    BodiesPoint at, full, next, best;
    Real hessian[BODIES_NEAR][36];
    Real row[2][BODIES_ROWS];                     /* what is summed over rows */
    Real matrix[BODIES_ROWS * (BODIES_ROWS + 1)]; /* [1 + H A | W + H (V - V_free)], active rows */
} BodiesWork;

/* One element at the start of a step. */
typedef struct {
    Real p[3]; /* [m] from the body's reference point, world axes */
    Real depth;
    Real slope[2];
    Real area_share; /* [-] 1 for a sole; 0: carries nothing */
    int state;       /* before the step, of bodies_state */
    int label;       /* that it stands on */
    Real down;       /* [-] of a shell: downward part of its normal */
    int faces_down;  /* bool: of a shell; 1 for a sole */
    int listed;      /* bool: may touch in this step */
    Real frame[3];   /* [-] of the body, in which its velocity and impulse are */
    ElementMemory before;
    Element element; /* with its share of the load */
    Share share;     /* that share, on ground with LAW_HEAP */
    int curves;
} BodiesElement;

/* The curves of an element in a step, of its material's bits. */
MILD_HD int bodies_curves(int bits, int curves) {
    return curves == LAW_ANY ? bits : curves == LAW_ALL ? bits & ~LAW_HEAP : curves;
}

/* A spot without a map. */
MILD_HD MapSpot bodies_no_spot(void) {
    const MapSpot none = {{0, 0}, {0, 0}, {0, 0}, {0, 0}, 0};
    return none;
}

/* p of element s. */
MILD_HD void bodies_point(const BodiesSole *sole, const Real *R, int s, Real *p) {
    const Real at[3] = {sole->x[s], sole->y[s], sole->face ? sole->face[s] : sole->z};
    for (int k = 0; k < 3; k++) {
        p[k] = R[3 * k] * at[0] + R[3 * k + 1] * at[1] + R[3 * k + 2] * at[2];
    }
}

/* Outward normal, world. */
MILD_HD void bodies_normal(const BodiesSole *sole, const Real *R, int s, Real *normal) {
    const Real *n = sole->face + sole->elements + s;
    const int next = sole->elements;
    for (int k = 0; k < 3; k++) {
        normal[k] = R[3 * k] * n[0] + R[3 * k + 1] * n[next] + R[3 * k + 2] * n[2 * next];
    }
}

/* Velocity of a point of a body under a twist. p: [m] from the body's reference point, world axes.
 * slope: gradient of the ground under it. */
MILD_HD ContactVelocity bodies_point_velocity(const Real *p, const Real *slope, const Real *V) {
    const Real z = V[2] + V[3] * p[1] - V[4] * p[0];
    ContactVelocity v;
    v.x = V[0] + V[4] * p[2] - V[5] * p[1];
    v.y = V[1] + V[5] * p[0] - V[3] * p[2];
    v.descent = slope[0] * v.x + slope[1] * v.y - z;
    return v;
}

/* That of an element. */
MILD_HD ContactVelocity bodies_velocity(const BodiesElement *own, const Real *V) {
    const Real level[2] = {0, 0};
    const ContactVelocity moves = bodies_point_velocity(own->p, level, V);
    const Real world[3] = {moves.x, moves.y, -moves.descent};
    Real v[3];
    frame_of_world(own->frame, world, v);
    const ContactVelocity own_way = {v[0], v[1],
                                     own->slope[0] * v[0] + own->slope[1] * v[1] - v[2]};
    return own_way;
}

/* ---- which bodies and elements ---- */

/* [m/s] Upper bounds on the speeds of a point of a body downward and level. */
MILD_HD void bodies_speeds(Real radius, const Real *V, Real *down, Real *level) {
    const Real tilt = V[3] * V[3] + V[4] * V[4];
    *down = real_max(-V[2], 0) + radius * REAL_SQRT(tilt);
    *level = REAL_SQRT(V[0] * V[0] + V[1] * V[1]) + radius * REAL_SQRT(tilt + V[5] * V[5]);
}

/* [m/s] Upper bound on the speed at which a point of a body gets deeper; foot_descent. */
MILD_HD Real bodies_descent(const BodiesSetup *setup, Real radius, const Real *V) {
    Real down, level;
    bodies_speeds(radius, V, &down, &level);
    return down + setup->steepest * level;
}

/* [m] Depth below which elements are listed; foot_set_least. */
MILD_HD Real bodies_least(const BodiesSetup *setup, Real radius, const Real *V, const Real *free) {
    const Real descent =
        real_max(bodies_descent(setup, radius, V), bodies_descent(setup, radius, free));
    return -BODIES_MARGIN - setup->dt * (descent + BODIES_EXTRA_SPEED);
}

/* [m] Upper bound on the depth of any element of a body at that pose; foot_reach. */
MILD_HD Real bodies_reach(const BodiesSetup *setup, int body, const Real *position, const Real *R,
                          const Real *map_origin, Real height) {
    const BodiesSole *sole = &setup->sole[body];
    Real at[3], slope[2], low = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        at[k] = R[3 * k] * sole->middle[0] + R[3 * k + 1] * sole->middle[1] +
                R[3 * k + 2] * sole->middle[2];
        low += REAL_ABS(R[6 + k]) * sole->half[k];
        square += sole->half[k] * sole->half[k];
    }
    if (!setup->has_map) {
        return height - position[2] - at[2] + low;
    }
    const MapSpot spot = map_spot(&setup->map, position, map_origin, height);
    const Real above = map_surface_near(&setup->map, &spot, at[0], at[1], slope);
    return above - at[2] + setup->steepest * REAL_SQRT(square) + low;
}

/* Bool: an element of a body at that pose may touch the ground in this step. bodies_reach is a
 * bound that the steepest place of a map makes wide; here an element has its own place, its own
 * speed and the plane under itself. The ground pushes where the depth in the middle of the step is
 * above 0, so an element that is left out would touch only if the step made it faster by more than
 * BODIES_GAIN; then it touches in the next step. On an uneven map a body that is left out forgets
 * the planes of the last step, and the surface may rise ahead of it: the bound there is wider. V:
 * twist. */
WARP_FN int bodies_touch(const BodiesSetup *setup, int body, const Real *position, const Real *R,
                         const Real *V, const Real *map_origin, Real height) {
    const BodiesSole *sole = &setup->sole[body];
    const MapSpot spot =
        setup->has_map ? map_spot(&setup->map, position, map_origin, height) : bodies_no_spot();
    const int uneven = setup->has_map && setup->map.uneven;
    const Real dt = setup->dt;
    Real found[LANE_COPIES];
    EACH_LANE(l) {
        found[l] = 0;
        LANE_ROLLED
        for (int s = LANE(l); s < sole->elements; s += LANES) {
            Real p[3], slope[2] = {0, 0};
            bodies_point(sole, R, s, p);
            const Real above = setup->has_map
                                   ? map_surface_near(&setup->map, &spot, p[0], p[1], slope)
                                   : height - position[2];
            const Real descent = real_max(bodies_point_velocity(p, slope, V).descent, 0);
            const Real way = uneven ? BODIES_MARGIN + dt * (descent + BODIES_EXTRA_SPEED / 2)
                                    : BODIES_ABOVE + dt / 2 * (descent + BODIES_GAIN);
            found[l] += above - p[2] + way > 0 ? 1 : 0;
        }
    }
    return lane_sum(found) > 0;
}

/* ---- an element at the start of a step ---- */

/* Sets the frame of the body at place i; foot_frame. */
MILD_HD void bodies_set_frame(const BodiesSetup *setup, BodiesWork *work, int i) {
    const BodiesSole *sole = &setup->sole[work->body[i]];
    const Real *R = work->rotation[i];
    const Real up[3] = {R[2], R[5], R[8]}, way[2] = {R[2] * sole->z, R[5] * sole->z};
    Real slope[2] = {0, 0};
    int label = 0;
    if (setup->has_map) {
        const MapSpot spot =
            map_spot(&setup->map, work->position[i], work->map_origin, work->height);
        map_surface_near(&setup->map, &spot, way[0], way[1], slope);
        label = map_label_near(&setup->map, &spot, way[0], way[1]);
    }
    const int wanted = work->label_material ? work->label_material[label] : 0;
    const int known = wanted >= 0 && wanted < setup->materials ? wanted : setup->materials;
    const ContactMaterial *material = &sole->table[known * sole->step];
    const int turns = !sole->face && material->projects > 0;
    frame_axis(up, slope[0], slope[1], turns ? frame_turn(material->recovery) : 0, work->frame[i]);
}

MILD_HD void bodies_record(const BodiesMemory *memory, int s, const ElementMemory *after,
                           Real worn) {
    contact_record(memory->element + s, memory->next, after);
    if (memory->worn) {
        memory->worn[s] = worn;
    }
}

/* State of element s of a body; of a sole, whose elements keep no state, from what it remembers. */
MILD_HD int bodies_state(const BodiesSetup *setup, const BodiesSole *sole,
                         const BodiesMemory *memory, int s) {
    const Real *at = memory->element + s;
    if (sole->face) {
        return (int)at[BODIES_STATE * memory->next];
    }
    if (at[0] > 0) {
        return setup->has_map ? 1 + (int)at[BODIES_STATE * memory->next] : 1;
    }
    return BODIES_FREE;
}

/* Surface and label under an element; the depth is not below the last step's plane
 * (slots_uneven). */
MILD_HD void bodies_survey(const BodiesSetup *setup, const BodiesWork *work, int i, int s,
                           int state, const MapSpot *spot, BodiesElement *own) {
    const MapView *map = &setup->map;
    const BodiesMemory *memory = &work->memory[i];
    const Real *plane = memory->element + BODIES_PLANE * memory->next + s;
    const Real *last = memory->body;
    const Real *p = own->p;
    own->depth = map_surface_near(map, spot, p[0], p[1], own->slope) - p[2];
    const int stood = state > 0 && state <= map->labels;
    own->label = stood ? state - 1 : map_label_near(map, spot, p[0], p[1]);
    const int remembers = state > 0 || (state == BODIES_FREE && own->depth > 0);
    if (map->uneven && last[BODIES_STEPPED * memory->step] > 0 && remembers) {
        const Real *at = work->position[i];
        const Real x = at[0] - last[0] + p[0];
        const Real y = at[1] - last[memory->step] + p[1];
        const Real raised = work->height - last[3 * memory->step];
        const Real z = at[2] - last[2 * memory->step] - raised + p[2];
        const Real below = plane[0] + plane[memory->next] * x + plane[2 * memory->next] * y - z;
        own->depth = real_min(own->depth, below);
    }
}

/* slot_scale: numbers that make force or mass. */
MILD_HD void bodies_scale(Element *e, Real share) {
    e->law.flat_stiffness *= share;
    e->law.line_stiffness *= share;
    e->law.mass_rate *= share;
    e->law.drag_rate *= share;
    e->law.bed_stiffness *= share;
    e->law.power_force *= share;
    e->law.elastic_force *= share;
    e->exit_drag *= share;
    e->entry_drag *= share;
    e->k_drift *= share;
    e->b_drift *= share;
}

/* The area share of an element of a shell, and its law times that: shell_laws and shell_unload. A
 * buried element begins without force; under elastic ground it has none. */
MILD_HD void bodies_share(const BodiesSetup *setup, const BodiesWork *work, int i, int s, int state,
                          const ContactMaterial *material, BodiesElement *own) {
    const BodiesSole *sole = &setup->sole[work->body[i]];
    const BodiesMemory *memory = &work->memory[i];
    Element *e = &own->element;
    const Real m0 = own->depth - setup->dt / 2 * bodies_velocity(own, work->velocity[i]).descent;
    const int buried = state == BODIES_BURIED && m0 > 0;
    const Real lasting = 1 - e->recovery;
    own->area_share =
        state > 0 ? memory->element[BODIES_AREA_SHARE * memory->next + s] : own->area_share;
    if (!(lasting > 0) && (buried || (state == BODIES_FREE && own->before.middle > 0))) {
        own->area_share = 0;
    }
    if (lasting > 0 && buried) {
        const Real least = real_max(m0 / lasting, m0 + ELEMENT_ELASTIC);
        own->before.depth_max = real_max(own->before.depth_max, least);
    }
    const int directed = (material->curves & LAW_RESIST) && material->law.flat_stiffness == 0 &&
                         material->law.power_force == 0;
    const Real whole = sole->face[4 * sole->elements + s];
    bodies_scale(e, directed && own->area_share > 0 ? whole : own->area_share);
}

/* The heap of element s, on ground with LAW_HEAP; sole_heap. */
MILD_HD void bodies_merge(const BodiesSole *sole, int s, const ContactMaterial *material,
                          Element *e) {
    if (material->projects > 0) {
        e->law = sole->face ? law_of_heap(e->law, LAW_HEAP_LEAST, sole->breadth)
                            : law_of_heap(e->law, sole->begin[s], sole->width[s]);
    }
}

MILD_HD Real bodies_rim_depth(const BodiesMemory *memory, int s, const BodiesElement *own) {
    return rim_depth(own->depth, memory->element[s]);
}

/* What is left of its load; slots_lean, and shell_lean of a shell. */
MILD_HD Real bodies_lean(const BodiesWork *work, const BodiesSole *sole, int i, int s,
                         const ContactMaterial *material, const BodiesElement *own) {
    const Real *R = work->rotation[i];
    const Real normal[3] = {R[2], R[5], R[8]};
    if (!sole->face) {
        return contact_lean(normal, own->slope[0], own->slope[1]);
    }
    const Real u = bodies_rim_depth(&work->memory[i], s, own);
    if (!(material->projects > 0 && u > 0)) {
        return 1;
    }
    const Law *law = &own->element.law;
    const Real bears =
        rim_bears(&work->rim[i], law, sole->breadth, own->p[0], own->p[1], u, own->down);
    return rim_share(law, own->element.recovery, bears, rim_force(law, u));
}

/* Its share of the load, there too. */
MILD_HD void bodies_carry(const BodiesSetup *setup, const BodiesWork *work, int i, int s,
                          const ContactMaterial *material, BodiesElement *own) {
    const BodiesSole *sole = &setup->sole[work->body[i]];
    const BodiesMemory *memory = &work->memory[i];
    const Real lean = bodies_lean(work, sole, i, s, material, own);
    const Real worn = memory->worn ? memory->worn[s] : 0;
    const Real elastic = law_elastic_force(&own->element.law, own->curves, own->element.middle);
    own->share = contact_share(material, !sole->face, worn);
    const ContactVelocity now = bodies_velocity(own, work->velocity[i]);
    Real ahead = 0;
    if (sole->face) {
        Real normal[3];
        bodies_normal(sole, work->rotation[i], s, normal);
        ahead = share_ahead(&own->element, &own->share, lean, normal, now.x, now.y, now.descent);
    }
    element_share(&own->element, &own->before, &own->share, elastic, setup->dt, 1 / setup->dt, lean,
                  ahead, now.x * now.x + now.y * now.y);
    element_share_virgin(&own->element, own->share.q);
}

/* contact_direct for a plate of its own. */
MILD_HD void bodies_direct(const BodiesSole *sole, const Real *R, int s,
                           const ContactMaterial *material, const ContactVelocity *now, Real dt,
                           BodiesElement *own) {
    Element *e = &own->element;
    if (!sole->face) {
        contact_direct(material, R, sole->square, now, dt, &own->before, e);
        return;
    }
    if (own->curves & LAW_RESIST) {
        Real normal[3];
        bodies_normal(sole, R, s, normal);
        const Plate plate = plate_facing(normal);
        element_resist(e, &own->before, &plate, (own->curves & LAW_SPACE) != 0, own->curves, dt,
                       1 / dt, e->law.line_stiffness, now->x, now->y, now->descent);
        if (sizeof(Real) < sizeof(double)) { /* contact_direct says why */
            e->yield_depth = real_max(e->yield_depth, e->middle);
        }
    }
    if (own->curves & LAW_SHEAR) {
        const Shear shear = {material->mu, material->cohesion, material->shear_length,
                             sole->square * own->area_share};
        element_shear(e, &own->before, &shear, own->curves, dt, 1 / dt);
    }
}

/* Its law in this step; foot_prepare. curves: of bodies_step. */
MILD_HD void bodies_begin(const BodiesSetup *setup, const BodiesWork *work, int i, int s,
                          BodiesElement *own, int curves) {
    const BodiesSole *sole = &setup->sole[work->body[i]];
    const int wanted = work->label_material ? work->label_material[own->label] : 0;
    const int known = wanted >= 0 && wanted < setup->materials ? wanted : setup->materials;
    const ContactMaterial *material = &sole->table[known * sole->step];
    const ContactVelocity now = bodies_velocity(own, work->velocity[i]);
    const Real free = bodies_velocity(own, work->free_velocity + 6 * i).descent;
    const Real dt = setup->dt;
    Element *e = &own->element;
    contact_stand_on(material, e);
    own->curves = bodies_curves(material->curves, curves);
    if (sole->face) {
        bodies_share(setup, work, i, s, own->state, material, own);
    }
    e->depth = own->depth;
    e->stop_drag = e->stop_growth = e->explicit_impulse = e->turn_x = e->turn_y = 0;
    if (own->curves & LAW_HEAP) {
        bodies_merge(sole, s, material, e);
    }
    element_begin(e, &own->before, own->curves, dt, 1 / dt, now.descent);
    if (own->curves & LAW_HEAP) {
        bodies_carry(setup, work, i, s, material, own);
    }
    if (own->curves & LAW_CONE) {
        const int cone = own->curves & (LAW_CONE | LAW_HEAP);
        const int created = law_creates(e->law.mass_rate, e->law.drag_rate);
        if (created && own->depth > 0 && e->middle >= own->before.depth_max) {
            e->explicit_impulse = element_explicit(e, cone, dt, free);
        }
        element_drag(e, cone, dt, real_max(free - now.descent, 0));
    }
    if (curves == LAW_ANY || curves == LAW_ALL) { /* materials may have bits of LawMotion */
        bodies_direct(sole, work->rotation[i], s, material, &now, dt, own);
    }
}

/* Where element s of the body at place i is. Its law and what it remembers are unset. */
MILD_HD void bodies_locate(const BodiesSetup *setup, const BodiesWork *work, int i, int s,
                           const MapSpot *spot, BodiesElement *own) {
    const BodiesSole *sole = &setup->sole[work->body[i]];
    const Real *R = work->rotation[i];
    own->state = bodies_state(setup, sole, &work->memory[i], s);
    own->slope[0] = own->slope[1] = 0;
    own->label = 0;
    own->area_share = 1;
    own->down = 1;
    bodies_point(sole, R, s, own->p);
    for (int k = 0; k < 3; k++) {
        own->frame[k] = work->frame[i][k];
    }
    if (sole->face) {
        Real normal[3];
        bodies_normal(sole, R, s, normal);
        own->down = -normal[2];
        own->area_share =
            own->down > SHARE_STEEP ? own->down * sole->face[4 * sole->elements + s] : 0;
    }
    own->faces_down = own->area_share > 0;
    if (setup->has_map) {
        bodies_survey(setup, work, i, s, own->state, spot, own);
    } else {
        own->depth = work->height - work->position[i][2] - own->p[2];
    }
    own->listed = own->faces_down && own->depth > work->least[i];
}

/* What it remembers and its law, after bodies_locate. */
MILD_HD void bodies_recall(const BodiesSetup *setup, const BodiesWork *work, int i, int s,
                           BodiesElement *own, int curves) {
    own->before = contact_recall(work->memory[i].element + s, work->memory[i].next);
    bodies_begin(setup, work, i, s, own, curves);
}

#include "ground/batch/bodies_newton.h"

/* ---- the end of a step ---- */

#include "ground/batch/bodies_finish.h"

/* Rounds of all elements of the body at place i. */
MILD_HD int bodies_rounds(const BodiesSetup *setup, const BodiesWork *work, int i) {
    return (setup->sole[work->body[i]].elements + LANES - 1) / LANES;
}

/* What a warp finishes at once: a round, from element `from` of the body at place i on. The sums
 * are left in work->part[round]. */
WARP_FN void bodies_finish_round(const BodiesSetup *setup, BodiesWork *work, int i, int from,
                                 int round, int advance, int curves) {
    const int elements = setup->sole[work->body[i]].elements;
    const MapSpot spot = bodies_spot(setup, work, i);
    Real sum[BODIES_LOADS - 1][LANE_COPIES], deepest[LANE_COPIES];
    EACH_LANE(l) {
        BodiesLoads own = {0, 0, 0, 0, 0, {0, 0, 0}};
        if (from + LANE(l) < elements) {
            bodies_finish_element(setup, work, i, from + LANE(l), &spot, work->next.twist + 6 * i,
                                  advance, &own, curves);
        }
        const Real all[BODIES_LOADS - 1] = {own.loaded, own.depth, own.force, own.area,
                                            own.p[0],   own.p[1],  own.p[2]};
        for (int n = 0; n < BODIES_LOADS - 1; n++) {
            sum[n][l] = all[n];
        }
        deepest[l] = own.deepest;
    }
    group_halve(sum, BODIES_LOADS - 1, LANES);
    const Real most = lane_max(deepest);
    EACH_LANE(l) {
        const int n = group_entry(LANE(l), LANES);
        if (n < BODIES_LOADS) {
            work->part[round][n] = n < BODIES_LOADS - 1 ? sum[0][l] : most;
        }
    }
}

/* The sums over the rounds of the body at place i. */
MILD_HD void bodies_report(const BodiesSetup *setup, BodiesWork *work, int i) {
    Real whole[BODIES_LOADS] = {0};
    int round = 0;
    ContactFoot *foot = &work->foot[i];
    for (int j = 0; j < i; j++) {
        round += bodies_rounds(setup, work, j);
    }
    const int end = round + bodies_rounds(setup, work, i);
    LANE_ROLLED
    for (; round < end; round++) {
        for (int n = 0; n < BODIES_LOADS - 1; n++) {
            whole[n] += work->part[round][n];
        }
        whole[BODIES_LOADS - 1] =
            real_max(whole[BODIES_LOADS - 1], work->part[round][BODIES_LOADS - 1]);
    }
    const int any = whole[0] > 0, bears = any && whole[2] > 0;
    for (int k = 0; k < 3; k++) {
        foot->pressure_center[k] = bears ? work->position[i][k] + whole[4 + k] / whole[2] : 0;
    }
    foot->depth_max = whole[BODIES_LOADS - 1];
    foot->depth_mean = any ? whole[1] / whole[0] : 0;
    foot->area = whole[3];
}

/* Where the body at place i is, for the next step. */
MILD_HD void bodies_remember(const BodiesSetup *setup, const BodiesWork *work, int i) {
    const BodiesMemory *memory = &work->memory[i];
    const int is_shell = setup->sole[work->body[i]].face != NULL;
    const int step = memory->step;
    if (is_shell || setup->has_map) {
        for (int k = 0; k < 3; k++) {
            memory->body[k * step] = work->position[i][k];
        }
        memory->body[3 * step] = work->height;
        memory->body[BODIES_STEPPED * step] = 1;
    }
    if (is_shell) {
        memory->body[BODIES_TOUCHED] = 1;
    }
}

/* Memory and reports at the twists of `next`. Rounds are dealt to the warps, body after body; then
 * a lane has a body. */
TEAM_FN void bodies_finish(const BodiesSetup *setup, BodiesWork *work, int advance, int curves) {
    int round = 0;
    LANE_ROLLED
    for (int i = 0; i < work->count; i++) {
        const int end = round + bodies_rounds(setup, work, i);
        LANE_ROLLED
        for (int from = 0; round < end; round++, from += LANES) {
            if (round % TEAM_WARPS == TEAM_WARP) {
                bodies_finish_round(setup, work, i, from, round, advance, curves);
            }
        }
    }
    team_sync(); /* what is read of the bodies' memory is written below */
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = TEAM_LANE(l); i < work->count; i += TEAM) {
            bodies_report(setup, work, i);
            if (advance) {
                bodies_remember(setup, work, i);
            }
        }
    }
    team_sync();
}

/* A shell far from the ground forgets the numbers of bodies_memory_numbers. */
WARP_FN void bodies_leave(const BodiesMemory *memory, int numbers) {
    const int touched = memory->body[BODIES_TOUCHED] > 0;
    lanes_sync(); /* all lanes have read it */
    if (touched) {
        EACH_LANE(l) {
            LANE_ROLLED
            for (int n = LANE(l); n < numbers; n += LANES) {
                memory->element[n] = 0;
            }
        }
        lanes_sync();
    }
}

/* Bool: row r of the results, and what its lane has of the problem, are numbers. */
MILD_HD int bodies_is_number(const BodiesWork *work, int r) {
    const int i = r / 6;
    Real sum = 0 * work->height + 0 * work->wrench[r] + 0 * work->next.twist[r];
    for (int k = r % 6; k < 9; k += 6) {
        sum += contact_blank(work->position[i], work->rotation[i], work->velocity[i],
                             work->free_velocity + 6 * i, k);
    }
    return sum == 0;
}

/* A whole step. advance: bool, the memory moves to its end. curves: of
 * batch_bodies_curves, a constant, because the code of one curve is shorter. */
TEAM_FN void bodies_step(const BodiesSetup *setup, BodiesWork *work, int advance, int curves) {
    const int rows = 6 * work->count;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = TEAM_LANE(l); i < work->count; i += TEAM) {
            work->least[i] = bodies_least(setup, setup->sole[work->body[i]].radius,
                                          work->velocity[i], work->free_velocity + 6 * i);
            bodies_set_frame(setup, work, i);
        }
    }
    team_sync();
    bodies_newton(setup, work, curves);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = TEAM_LANE(l); r < rows; r += TEAM) {
            work->next.twist[r] =
                work->free_velocity[r] + bodies_times(work, rows, r, work->best.wrench);
            work->wrench[r] = work->best.wrench[r] / setup->dt;
            if (!bodies_is_number(work, r)) {
                work->residual = REAL(NAN); /* lanes that write it write the same */
            }
        }
    }
    team_sync();
    bodies_finish(setup, work, advance && work->residual >= 0, curves);
}

#endif
