/* The end of a step of bodies.h: what an element remembers. */
#ifndef MILD_BATCH_BODIES_FINISH_H
#define MILD_BATCH_BODIES_FINISH_H

/* What is summed over a body's loaded elements; force and p over all, loaded or not. */
typedef struct {
    Real loaded, depth, force, area, deepest, p[3];
} BodiesLoads;
#define BODIES_LOADS 8 /* numbers of it; in sums the deepest is the last */

MILD_HD void bodies_chart(const BodiesMemory *memory, int s, const BodiesElement *own) {
    Real *plane = memory->element + BODIES_PLANE * memory->next + s;
    const Real *p = own->p;
    plane[0] = own->depth - own->slope[0] * p[0] - own->slope[1] * p[1] + p[2];
    plane[memory->next] = own->slope[0];
    plane[2 * memory->next] = own->slope[1];
}

/* An element of a shell that does not take part forgets. One that faces up near the ground is
 * buried until it comes out; so is one that carries nothing. state: before the step. */
MILD_HD void bodies_forget(const BodiesMemory *memory, int s, int state, int buried) {
    const ElementMemory none = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    const int after = buried ? BODIES_BURIED : BODIES_NONE;
    if (state != after) { /* else there is nothing to forget */
        bodies_record(memory, s, &none, 0);
        memory->element[BODIES_STATE * memory->next + s] = (Real)after;
        memory->element[BODIES_AREA_SHARE * memory->next + s] = 0;
    }
}

/* An element of a sole that was in the air and stays there: a map's surface under it. */
MILD_HD void bodies_hover(const BodiesSetup *setup, const BodiesMemory *memory, int s,
                          const BodiesElement *own) {
    if (setup->has_map) {
        memory->element[BODIES_STATE * memory->next + s] = (Real)own->label;
        bodies_chart(memory, s, own);
    }
}

/* Where element s of a body is after the step: label, area share and surface. stays: bool. */
MILD_HD void bodies_settle(const BodiesSetup *setup, const BodiesSole *sole,
                           const BodiesMemory *memory, int s, const BodiesElement *own, int stays) {
    const int uneven = setup->has_map && setup->map.uneven;
    Real *state = memory->element + BODIES_STATE * memory->next + s;
    if (sole->face) {
        *state = (Real)(stays ? 1 + own->label : uneven ? BODIES_FREE : BODIES_NONE);
        state[memory->next] = stays ? own->area_share : 0;
    } else if (setup->has_map) {
        *state = (Real)own->label;
    }
    if (setup->has_map) {
        bodies_chart(memory, s, own);
    }
}

/* [N s] Vertical impulse of an element with the normal impulse `normal` at the velocity v. */
MILD_HD Real bodies_lift(const BodiesElement *own, Real normal, const ContactVelocity *v) {
    const Element *e = &own->element;
    const Friction f = friction_impulse(e, friction_bound(e, normal), e->mu, v->x, v->y);
    Real I[3] = {f.x - own->slope[0] * normal, f.y - own->slope[1] * normal, normal};
    frame_to_world(own->frame, I, I);
    return I[2];
}

/* Adds an element. loaded: bool. force: [N s] vertical. area: [m^2]. */
MILD_HD void bodies_load_add(BodiesLoads *loads, const BodiesElement *own, int loaded, Real force,
                             Real area) {
    if (loaded) {
        loads->loaded += 1;
        loads->depth += own->depth;
        loads->area += area;
        loads->deepest = real_max(loads->deepest, own->depth);
    }
    loads->force += force;
    for (int k = 0; k < 3; k++) {
        loads->p[k] += force * own->p[k];
    }
}

/* Memory of an element at the twist V. advance: bool, of contact.inc. */
MILD_HD void bodies_finish_element(const BodiesSetup *setup, const BodiesWork *work, int i, int s,
                                   const MapSpot *spot, const Real *V, int advance,
                                   BodiesLoads *loads, int curves) {
    const BodiesSole *sole = &setup->sole[work->body[i]];
    const BodiesMemory *memory = &work->memory[i];
    const Real dt = setup->dt;
    BodiesElement own;
    bodies_locate(setup, work, i, s, spot, &own);
    if (!own.listed && (sole->face || !(memory->element[s] > 0))) {
        if (advance && sole->face) {
            bodies_forget(memory, s, own.state, !own.faces_down && own.depth > work->least[i]);
        } else if (advance) {
            bodies_hover(setup, memory, s, &own);
        }
        return;
    }
    bodies_recall(setup, work, i, s, &own, curves);
    if (sole->face && !(own.area_share > 0)) {
        if (advance) {
            bodies_forget(memory, s, own.state, 1);
        }
        return;
    }
    const Element *e = &own.element;
    const ContactVelocity v = bodies_velocity(&own, V);
    const Real middle = own.depth + dt / 2 * v.descent;
    const Real sinks = dt * frame_sinks(own.frame, own.slope[0], own.slope[1], v.x, v.y, v.descent);
    const int stays = middle > 0 && element_deepest(e, middle) + sinks > 0;
    const Real normal = element_impulse(e, own.curves, 1, dt, v.descent).value;
    ElementMemory after =
        element_remember(e, &own.before, dt, 1 / dt, normal, v.x, v.y, v.descent, stays);
    Real worn = 0;
    after = element_sunk(after, sinks, stays);
    if (own.curves & LAW_HEAP) {
        worn = element_wear_alone(e, &own.before, &own.share, &after, dt, normal, v.x, v.y,
                                  v.descent, frame_slices(own.frame, v.x, v.y), stays);
    }
    if (stays) {
        const Real peak = element_peak(e, own.curves, normal, v.descent, middle);
        after.depth_max =
            real_max(after.depth_max, e->virgin_depth + peak - e->yield_depth + sinks);
    }
    if (advance) {
        bodies_record(memory, s, &after, worn);
        bodies_settle(setup, sole, memory, s, &own, stays);
    }
    const Real force = bodies_lift(&own, normal, &v);
    bodies_load_add(loads, &own, normal > 0, force, own.area_share * sole->square);
}

#endif
