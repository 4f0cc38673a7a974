/* Resistive force theory: the stress on a plate is zeta 1e6 N/m^3 times its depth times
 * coefficients that depend on how the plate stands and where it moves. 2D: Li, Zhang, Goldman,
 * Science 339 (2013), generic coefficients; here in the vertical plane of each element's motion.
 * 3D: Agarwal, Goldman, Kamrin, PNAS 120 (2023).
 *
 * In the implicit step the direction of motion is that at the start of the step. Each element then
 * has a yield stress downward and one sideways: down      the slope of virgin ground becomes share
 * * peak, share = alpha_z/RESIST_PEAK sideways  the radius of the friction disc, dt zeta 1e6 s u
 * alpha_x: opposes the motion, never reverses it so the step stays convex. What a tilted plate
 * would feel across its horizontal motion, or before it moves sideways at all, is left out: taken
 * at the old speed and not opposed to the new one, it could create energy. At rest no direction is
 * defined and an element may give way either way: RESIST_REST blends towards straight down for the
 * one yield and towards level for the other.
 *
 * No energy from a changing direction: the elastic travel (CONTACT_ELASTIC) belongs to the peak
 * whatever the direction, so it stores what a function of depth and front alone says; an element
 * that yields below the peak does so on the way up that line, at `front`, before it gets to the
 * depth `deep` that it remembers: travel (1 - share) deeper. */
#include "ground/resist.h"

#include "ground/friction.h"

#define RESIST_REST 1e-3 /* [m/s] */
#define RESIST_PEAK                                                                                \
    1.08 /* greatest alpha_z of both theories: 1 (2D, level, straight down), 1.076 (3D, 27         \
            degrees) */
#define RESIST_LEVEL 0.87504 /* alpha_z of the 3D theory for a level plate going straight down */

/* N/cm^3, Li et al. 2013, table S3, generic. */
static const double A00 = 0.206, A10 = 0.169, B11 = 0.212, B01 = 0.358, BM11 = 0.055;
static const double C11 = -0.124, C01 = 0.253, CM11 = 0.007, D10 = 0.088;

/* c2, s2: cosine and sine of 2 beta; c, s: of gamma. */
ALWAYS_INLINE void plane_alpha(double c2, double s2, double c, double s, double *ax, double *az) {
    double sum = s2 * c + c2 * s,
           difference = c2 * s - s2 * c; /* sin(2 beta + gamma), sin(-2 beta + gamma) */
    *ax = C11 * (c2 * c - s2 * s) + C01 * c + CM11 * difference + D10 * s2;
    *az = A00 + A10 * c2 + B11 * sum + B01 * s + BM11 * difference;
}

void mild_resist_plane(double beta, double gamma, double alpha[2]) {
    plane_alpha(cos(2.0 * beta), sin(2.0 * beta), cos(gamma), sin(gamma), &alpha[0], &alpha[1]);
}

/* Powers of x1 = sin(gamma) = -v_z, x2 = cos(beta) = -n_z, x3 = n . v, and the coefficients of f1,
 * f2, f3 (Agarwal et al. 2023, supplement): alpha = f1 n + f2 v + f3 (0, 0, -1). */
static const double space_coefficients[3][20] = {
    {0.00212,  -0.02320, -0.20890, -0.43083, -0.00259, 0.48872, -0.00415,
     0.07204,  -0.02750, -0.08772, 0.01992,  -0.45961, 0.40799, -0.10107,
     -0.06576, 0.05664,  -0.09269, 0.01892,  0.01033,  0.15120},
    {-0.06796, -0.10941, 0.04725, -0.06914, -0.05835, -0.65880, -0.11985,
     -0.25739, -0.26834, 0.02692, -0.00736, 0.63758,  0.08997,  0.21069,
     0.04748,  0.20406,  0.18589, 0.04934,  0.13527,  -0.33207},
    {-0.02634, -0.03436, 0.45256, 0.00835,  0.02553, -1.31290, -0.05532,
     0.06790,  -0.16404, 0.02287, 0.02927,  0.95406, -0.00131, -0.11028,
     0.01487,  -0.02730, 0.10911, -0.04097, 0.07881, -0.27519}};

/* Those polynomials for one plate, x2 held: of 1, x1, x3, x1^2, x1 x3, x3^2, x1^3, x1^2 x3, x1
 * x3^2, x3^3. */
typedef double Cubic[10];

static void cubic_at(const double *c, double y, Cubic a) {
    const double square = y * y;
    a[0] = c[0] + c[2] * y + c[5] * square + c[11] * square * y;
    a[1] = c[1] + c[7] * y + c[13] * square;
    a[2] = c[3] + c[8] * y + c[16] * square;
    a[3] = c[4] + c[14] * y;
    a[4] = c[9] + c[19] * y;
    a[5] = c[6] + c[15] * y;
    a[6] = c[10];
    a[7] = c[17];
    a[8] = c[18];
    a[9] = c[12];
}

ALWAYS_INLINE double cubic(const double *a, double x, double z) {
    return a[0] + x * (a[1] + x * (a[3] + x * a[6])) +
           z * (a[2] + z * (a[5] + z * a[9]) + x * (a[4] + x * a[7] + z * a[8]));
}

void mild_resist_space(const double normal[3], const double direction[3], double alpha[3]) {
    double x = -direction[2],
           z = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2], f[3];
    for (int k = 0; k < 3; k++) {
        Cubic a;
        cubic_at(space_coefficients[k], -normal[2], a);
        f[k] = cubic(a, x, z);
    }
    double scale = z < 0.0 ? 0.0 : 1.0 / RESIST_LEVEL; /* a trailing face feels nothing */
    for (int k = 0; k < 3; k++) {
        alpha[k] = scale * (f[0] * normal[k] + f[1] * direction[k] - (k == 2 ? f[2] : 0.0));
    }
}

/* The sole as a plate: its normal into the ground, and the polynomials at that normal. */
typedef struct {
    double normal[3], tilt;
    Cubic f[3];
} Plate;

static Plate plate_of(const double *rotation) {
    double side =
        rotation[8] > 0.0 ? -1.0 : 1.0; /* of the sole's two faces the one that looks down */
    Plate plate = {
        .normal = {side * rotation[2], side * rotation[5], step_min(side * rotation[8], -1e-6)}};
    plate.tilt =
        sqrt(plate.normal[0] * plate.normal[0] + plate.normal[1] * plate.normal[1]) + STEP_TINY;
    for (int k = 0; k < 3; k++) {
        cubic_at(space_coefficients[k], -plate.normal[2], plate.f[k]);
    }
    return plate;
}

/* alpha_x against the heading at level and downward speeds, and alpha_z; lean: the normal's part
 * along the heading. */
ALWAYS_INLINE void plate_alpha(const Plate *plate, int model, double lean, double level,
                               double down, double *ax, double *az) {
    double scale = 1.0 / sqrt(level * level + down * down), c = level * scale, s = down * scale;
    if (model == MILD_MODEL_ECC_QUASI) {
        double slope = lean * (-1.0 / plate->normal[2]), whole = 1.0 / (1.0 + slope * slope);
        plane_alpha((1.0 - slope * slope) * whole, 2.0 * slope * whole, c, s, ax, az);
    } else {
        double z = lean * c - plate->normal[2] * s, faces = z < 0.0 ? 0.0 : 1.0 / RESIST_LEVEL;
        double f1 = cubic(plate->f[0], s, z), f2 = cubic(plate->f[1], s, z),
               f3 = cubic(plate->f[2], s, z);
        *ax = -faces * (f1 * lean + f2 * c);
        *az = faces * (f1 * plate->normal[2] - f2 * s - f3);
    }
}

ALWAYS_INLINE void slot_resist(const Slots *s, int i, double dt, double rate, double sideways,
                               double downward) {
    double u0 = s->depth[i], m0 = s->middle[i], level = s->strength[i], peak = RESIST_PEAK * level;
    double share = step_min(step_max(downward / RESIST_PEAK, 0.0), 1.0),
           lead = CONTACT_ELASTIC * (1.0 - share);
    double led = m0 > 0.0 ? step_min(m0 + lead, m0 / (share + STEP_TINY)) : 0.0,
           deep = step_max(led, s->deep[i]);
    double in_bed = deep - s->bed[i], stiffness = s->bed_stiffness[i],
           bed = in_bed > 0.0 ? stiffness : 0.0;
    double force = peak * deep + bed * in_bed;
    double line = step_max(force / (step_min(CONTACT_ELASTIC, deep) + STEP_TINY), peak + bed),
           inverse = 1.0 / line;
    double slack = deep - force * inverse,
           front = slack + (share * peak * deep + bed * in_bed) * inverse;
    s->cone[i] = share * peak;
    s->deep[i] = deep;
    s->line[i] = line;
    s->slack[i] = slack;
    s->front[i] = front;
    s->reach[i] = step_max(2.0 * (front - u0) * rate, 0.0);
    s->drift_radius[i] += dt * level * step_max(sideways, 0.0) * step_max(u0, 0.0);
    slot_grip(s, i, dt, rate, share * peak * deep + bed * in_bed);
}

/* The slots from `start` on that stand on this model. */
ALWAYS_INLINE void slots_model(const Slots *slot, int start, int end, double dt, const Plate *sole,
                               const Motion *now, int model) {
    const Slots local = *slot, *s = &local;
    const Plate plate = *sole;
    const Motion m = *now;
    double rate = 1.0 / dt, rest = RESIST_REST / plate.tilt, rest_x = rest * plate.normal[0],
           rest_y = rest * plate.normal[1];
#pragma omp simd
    for (int i = start; i < end; i++) {
        double x = s->x[i], y = s->y[i], vx = m.x[0] + m.x[1] * x + m.x[2] * y,
               vy = m.y[0] + m.y[1] * x + m.y[2] * y;
        double w = s->slope_x[i] * vx + s->slope_y[i] * vy - (m.z[0] + m.z[1] * x + m.z[2] * y),
               down = step_max(w, 0.0);
        /* heading: of the motion, at rest of the tilt; any where there is neither, as a level
         * plate's are all alike */
        double hx = vx + rest_x, hy = vy + rest_y, length = sqrt(hx * hx + hy * hy),
               scale = 1.0 / (length + STEP_TINY);
        double lean = (plate.normal[0] * hx + plate.normal[1] * hy) * scale;
        double moves = sqrt(vx * vx + vy * vy),
               speed = moves * FRICTION_LAG < 1.0 ? 0.0 : moves; /* friction may hold it yet */
        double down_x, down_z, level_x, level_z;
        plate_alpha(&plate, model, lean, speed, down + RESIST_REST, &down_x, &down_z);
        plate_alpha(&plate, model, lean, speed + RESIST_REST, down, &level_x, &level_z);
        slot_resist(s, i, dt, rate, level_x, down_z);
    }
}

/* Bool: there is such a material; only: there is no other. */
static int terrain_resists(const MildTerrain *terrain, int model, int *only) {
    int any = 0;
    *only = 1;
    for (int m = 0; m < terrain->material_count; m++) {
        any |= terrain->materials[m].model == model;
        *only &= terrain->materials[m].model == model;
    }
    return any;
}

void slots_resist(const FootScratch *foot, const MildTerrain *terrain, double dt,
                  const double *rotation, const Motion *now) {
    static const int models[2] = {MILD_MODEL_ECC_QUASI, MILD_MODEL_ECC_QUASI_3D};
    const Slots *s = &foot->slot;
    for (int k = 0; k < 2; k++) {
        int only, model = models[k];
        if (!terrain_resists(terrain, model, &only)) {
            continue;
        }
        Plate plate = plate_of(rotation);
        if (only && k == 0) {
            slots_model(s, 0, foot->active, dt, &plate, now, MILD_MODEL_ECC_QUASI);
        }
        if (only && k == 1) {
            slots_model(s, 0, foot->active, dt, &plate, now, MILD_MODEL_ECC_QUASI_3D);
        }
        for (int i = 0; !only && i < foot->active; i++) {
            if (terrain->materials[foot->slot_material[i] & 0xff].model != model) {
                continue; /* the nearer one's */
            }
            if (s->flat[i] != 0.0) {
                continue; /* blended with a cone: as a level plate */
            }
            slots_model(s, i, i + 1, dt, &plate, now, model);
        }
    }
}
