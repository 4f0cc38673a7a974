/* Resistive force theory: the stress on a plate is zeta 1e6 N/m^3 times its depth times coefficients that depend on how the
 * plate stands and where it moves. 2D: Li, Zhang, Goldman, Science 339 (2013), generic coefficients; here in the vertical
 * plane of each element's motion. 3D: Agarwal, Goldman, Kamrin, PNAS 120 (2023).
 *
 * In the implicit step the direction of motion is that at the start of the step. Each element then has a yield stress
 * downward and one sideways:
 *   down      the slope of virgin ground becomes share * peak, share = alpha_z/RESIST_PEAK
 *   sideways  the radius of the friction disc, dt zeta 1e6 s u alpha_x: opposes the motion, never reverses it
 * so the step stays convex. What a tilted plate would feel across its horizontal motion, or before it moves sideways at all,
 * is left out: taken at the old speed and not opposed to the new one, it could create energy. At rest no direction is
 * defined and an element may give way either way: RESIST_REST blends towards straight down for the one yield and towards
 * level for the other.
 *
 * No energy from a changing direction: the elastic travel (CONTACT_ELASTIC) belongs to the peak whatever the direction, so
 * it stores what a function of depth and front alone says; an element that yields below the peak does so on the way up that
 * line, at `front`, before it gets to the depth `deep` that it remembers: travel (1 - share) deeper. */
#include "ground/resist.h"

#include "ground/friction.h"

#define RESIST_REST 1e-3  /* [m/s] */
#define RESIST_PEAK 1.08  /* greatest alpha_z of both theories: 1 (2D, level, straight down), 1.076 (3D, 27 degrees) */
#define RESIST_LEVEL 0.87504 /* alpha_z of the 3D theory for a level plate going straight down */

/* N/cm^3, Li et al. 2013, table S3, generic. */
static const double A00 = 0.206, A10 = 0.169, B11 = 0.212, B01 = 0.358, BM11 = 0.055;
static const double C11 = -0.124, C01 = 0.253, CM11 = 0.007, D10 = 0.088;

/* c2, s2: cosine and sine of 2 beta; c, s: of gamma. */
static void plane_alpha(double c2, double s2, double c, double s, double alpha[2]) {
    double sum = s2 * c + c2 * s, difference = c2 * s - s2 * c; /* sin(2 beta + gamma), sin(-2 beta + gamma) */
    alpha[0] = C11 * (c2 * c - s2 * s) + C01 * c + CM11 * difference + D10 * s2;
    alpha[1] = A00 + A10 * c2 + B11 * sum + B01 * s + BM11 * difference;
}

void mild_resist_plane(double beta, double gamma, double alpha[2]) {
    plane_alpha(cos(2.0 * beta), sin(2.0 * beta), cos(gamma), sin(gamma), alpha);
}

/* Powers of x1 = sin(gamma) = -v_z, x2 = cos(beta) = -n_z, x3 = n . v, and the coefficients of f1, f2, f3 (Agarwal et al.
 * 2023, supplement): alpha = f1 n + f2 v + f3 (0, 0, -1). */
static const double space_coefficients[3][20] = {
    {0.00212, -0.02320, -0.20890, -0.43083, -0.00259, 0.48872,  -0.00415, 0.07204,  -0.02750, -0.08772,
     0.01992, -0.45961, 0.40799,  -0.10107, -0.06576, 0.05664,  -0.09269, 0.01892,  0.01033,  0.15120},
    {-0.06796, -0.10941, 0.04725, -0.06914, -0.05835, -0.65880, -0.11985, -0.25739, -0.26834, 0.02692,
     -0.00736, 0.63758,  0.08997, 0.21069,  0.04748,  0.20406,  0.18589,  0.04934,  0.13527,  -0.33207},
    {-0.02634, -0.03436, 0.45256,  0.00835,  0.02553, -1.31290, -0.05532, 0.06790,  -0.16404, 0.02287,
     0.02927,  0.95406,  -0.00131, -0.11028, 0.01487, -0.02730, 0.10911,  -0.04097, 0.07881,  -0.27519}};

void mild_resist_space(const double normal[3], const double direction[3], double alpha[3]) {
    double x = -direction[2], y = -normal[2], z = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2];
    const double powers[20] = {1.0,       x,         y,         z,         x * x,     y * y,     z * z,
                               x * y,     y * z,     z * x,     x * x * x, y * y * y, z * z * z, x * y * y,
                               y * x * x, y * z * z, z * y * y, z * x * x, x * z * z, x * y * z};
    double f[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 20; i++) f[k] += space_coefficients[k][i] * powers[i];
    double scale = z < 0.0 ? 0.0 : 1.0 / RESIST_LEVEL; /* a trailing face feels nothing */
    for (int k = 0; k < 3; k++) alpha[k] = scale * (f[0] * normal[k] + f[1] * direction[k] - (k == 2 ? f[2] : 0.0));
}

/* How an element moves: horizontal speed and unit heading (0 when neither motion nor tilt gives one), downward speed. */
typedef struct {
    double speed, x, y, down;
} Way;

static Way element_way(double vx, double vy, double down, const double *normal) {
    double tilt = sqrt(normal[0] * normal[0] + normal[1] * normal[1]) + STEP_TINY;
    double x = vx + RESIST_REST * normal[0] / tilt, y = vy + RESIST_REST * normal[1] / tilt, length = sqrt(x * x + y * y);
    double scale = length > STEP_TINY ? 1.0 / length : 0.0;
    return (Way){sqrt(vx * vx + vy * vy), x * scale, y * scale, step_max(down, 0.0)};
}

/* alpha_x resisting the heading at level, downward speeds (level, down), and alpha_z. */
static void way_alpha(int model, const Way *way, const double *normal, double level, double down, double alpha[2]) {
    double scale = 1.0 / sqrt(level * level + down * down), c = level * scale, s = down * scale;
    if (model == MILD_MODEL_ECC_QUASI) {
        double slope = (normal[0] * way->x + normal[1] * way->y) / -normal[2], whole = 1.0 / (1.0 + slope * slope);
        plane_alpha((1.0 - slope * slope) * whole, 2.0 * slope * whole, c, s, alpha);
        return;
    }
    const double direction[3] = {c * way->x, c * way->y, -s};
    double force[3];
    mild_resist_space(normal, direction, force);
    alpha[0] = -(force[0] * way->x + force[1] * way->y);
    alpha[1] = force[2];
}

static void slot_resist(const Slots *s, int i, double dt, double sideways, double downward) {
    double u0 = s->depth[i], m0 = s->middle[i], level = s->strength[i], peak = RESIST_PEAK * level;
    double share = step_min(step_max(downward / RESIST_PEAK, 0.0), 1.0), lead = CONTACT_ELASTIC * (1.0 - share);
    double led = m0 > 0.0 ? step_min(m0 + lead, m0 / (share + STEP_TINY)) : 0.0, deep = step_max(led, s->deep[i]);
    double in_bed = deep - s->bed[i], bed = in_bed > 0.0 ? s->bed_stiffness[i] : 0.0, force = peak * deep + bed * in_bed;
    double line = step_max(force / (step_min(CONTACT_ELASTIC, deep) + STEP_TINY), peak + bed), slack = deep - force / line;
    s->cone[i] = share * peak;
    s->deep[i] = deep;
    s->line[i] = line;
    s->slack[i] = slack;
    s->front[i] = slack + (share * peak * deep + bed * in_bed) / line;
    s->reach[i] = step_max(2.0 * (s->front[i] - u0) / dt, 0.0);
    s->drift_radius[i] += dt * level * step_max(sideways, 0.0) * step_max(u0, 0.0);
    slot_grip(s, i, dt, 1.0 / dt, share * peak * deep + bed * in_bed);
}

static int any_resistive(const MildTerrain *terrain) {
    int any = 0;
    for (int m = 0; m < terrain->material_count; m++) any |= model_is_resistive(terrain->materials[m].model);
    return any;
}

void slots_resist(const FootScratch *foot, const MildTerrain *terrain, double dt, const double *rotation, const Motion *now) {
    if (!any_resistive(terrain)) return;
    const Slots *s = &foot->slot;
    double side = rotation[8] > 0.0 ? -1.0 : 1.0; /* of the sole's two faces the one that looks down */
    const double normal[3] = {side * rotation[2], side * rotation[5], step_min(side * rotation[8], -1e-6)};
    for (int i = 0; i < foot->active; i++) {
        int model = terrain->materials[foot->slot_material[i] & 0xff].model; /* the nearer one's */
        if (!model_is_resistive(model) || s->flat[i] != 0.0) continue; /* blended with a cone: as a level plate */
        double x = s->x[i], y = s->y[i], down[2], level[2];
        Way way = element_way(motion_at(now->x, x, y), motion_at(now->y, x, y), slot_descent(s, i, now), normal);
        if (way.speed * FRICTION_LAG < 1.0) way.speed = 0.0; /* friction may hold it yet */
        way_alpha(model, &way, normal, way.speed, way.down + RESIST_REST, down);
        way_alpha(model, &way, normal, way.speed + RESIST_REST, way.down, level);
        slot_resist(s, i, dt, level[0], down[1]);
    }
}
