#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/step/literal.h"

double literal_normal(const Slots *s, int i, int curves, double dt, double w) {
    const Element element = slot_loaded(s, i, curves);
    const double u = element.depth;
    double force = law_force(&element.law, curves, u) + law_elastic_force(&element.law, curves, u);
    if (curves & LAW_CONE) {
        force += element.law.drag_rate * law_moved_share(&element.law, curves, u) * w * w;
    }
    return u > 0.0 ? dt * fmax(force, 0.0) : 0.0;
}

void literal_friction(Slots *s, int i, const double *v, const double *delta, double G) {
    const double beta = 0.5 / G; /* [kg] */
    const double gamma = 0.1 * beta;
    const double x = s->fx[i] - gamma * delta[0] - beta * v[0];
    const double y = s->fy[i] - gamma * delta[1] - beta * v[1];
    const double radius = s->mu[i] * s->iz[i];
    const double length = sqrt(x * x + y * y);
    const double scale = length > radius ? radius / length : 1.0;
    s->fx[i] = x * scale;
    s->fy[i] = y * scale;
    s->ix[i] = s->fx[i] - s->slope_x[i] * s->iz[i];
    s->iy[i] = s->fy[i] - s->slope_y[i] * s->iz[i];
}

void literal_drift(const MildScratch *scratch, const MildContactInput *input) {
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        const Motion motion = foot_motion(foot, input->velocity[f]);
        for (int slot = 0; slot < foot->active; slot++) {
            Slots *s = slot_block(foot, slot);
            const int i = slot % SLOT_LANES;
            const SlotVelocity v = slot_velocity(s, i, &motion, SLOT_UNEVEN | SLOT_SHELL);
            const double speed = sqrt(v.x * v.x + v.y * v.y);
            const double drag = s->drift_bound[i] + s->damping[i] * speed;
            s->ix[i] -= speed > 0.0 ? drag * v.x / speed : 0.0;
            s->iy[i] -= speed > 0.0 ? drag * v.y / speed : 0.0;
        }
    }
}
