/* Resistive force theory: the stress on a plate is zeta 1e6 N/m^3 times its depth times
 * coefficients that depend on the orientation and the direction of motion of the plate.
 *
 *     2D   Li, Zhang, Goldman, Science 339 (2013), generic coefficients; here in the vertical plane
 *          of each element's motion
 *     3D   Agarwal, Goldman, Kamrin, PNAS 120 (2023)
 * The implicit step uses the direction of motion at the start of the step. With it fixed, an
 * element has two yield stresses:
 *
 *     downward   the slope of virgin ground becomes share peak, share = alpha_z/RESIST_PEAK
 *     sideways   the radius of the friction disc grows by dt zeta 1e6 s u alpha_x. Friction opposes
 *                the motion and never reverses it, so the step stays convex
 *
 * Two horizontal forces on a tilted plate are left out: the one across its motion, and the one
 * before it moves sideways at all. They do not oppose the new velocity, so taken at the old
 * velocity they could create energy.
 *
 * At rest the direction is undefined, and an element may yield to any side. Below RESIST_REST the
 * direction blends to straight down for the downward yield stress, and to horizontal for the
 * sideways one.
 *
 * A change of direction must not create energy. The unloading line is therefore that of the peak
 * for every direction. Its upper end b lies ELEMENT_ELASTIC (1 - share) deeper than an element with
 * a smaller share has been. The element yields on that line, at the depth where the line gives its
 * yield force. */
#include "ground/resist.h"

#include "ground/element_law.h"
#include "ground/friction.h"

/* [-] alpha_z of the 3D theory for a level plate moving straight down. */
#define RESIST_LEVEL 0.87504

/* [N/cm^3] Li et al. 2013, table S3, generic coefficients. */
static const double A00 = 0.206, A10 = 0.169, B11 = 0.212, B01 = 0.358, BM11 = 0.055;
static const double C11 = -0.124, C01 = 0.253, CM11 = 0.007, D10 = 0.088;

/* Coefficients of the force on a plate. */
typedef struct {
    double x; /* [-] against its horizontal motion */
    double z; /* [-] up */
} Alpha;

/* The 2D theory. c2, s2: cosine and sine of 2 beta. c, s: cosine and sine of gamma. */
ALWAYS_INLINE Alpha plane_alpha(double c2, double s2, double c, double s) {
    const double sum = s2 * c + c2 * s;        /* sin(2 beta + gamma) */
    const double difference = c2 * s - s2 * c; /* sin(-2 beta + gamma) */
    return (Alpha){C11 * (c2 * c - s2 * s) + C01 * c + CM11 * difference + D10 * s2,
                   A00 + A10 * c2 + B11 * sum + B01 * s + BM11 * difference};
}

void mild_resist_plane(double beta, double gamma, double alpha[2]) {
    const Alpha plane = plane_alpha(cos(2.0 * beta), sin(2.0 * beta), cos(gamma), sin(gamma));
    alpha[0] = plane.x;
    alpha[1] = plane.z;
}

/* The 3D theory (Agarwal et al. 2023, supplement): alpha = f1 n + f2 v + f3 (0, 0, -1). The
 * coefficients of f1, f2, f3 belong to powers of x1 = sin(gamma) = -v_z, x2 = cos(beta) = -n_z, x3
 * = n . v. */
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

/* One of the polynomials for a given plate, for which x2 is constant: coefficients of 1, x1, x3,
 * x1^2, x1 x3, x3^2, x1^3, x1^2 x3, x1 x3^2, x3^3. */
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
    double x = -direction[2];
    double z = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2];
    double f[3];
    for (int k = 0; k < 3; k++) {
        Cubic a;
        cubic_at(space_coefficients[k], -normal[2], a);
        f[k] = cubic(a, x, z);
    }
    double scale = z < 0.0 ? 0.0 : 1.0 / RESIST_LEVEL; /* no force on a trailing face */
    for (int k = 0; k < 3; k++) {
        alpha[k] = scale * (f[0] * normal[k] + f[1] * direction[k] - (k == 2 ? f[2] : 0.0));
    }
}

/* The sole as a plate. */
typedef struct {
    double normal[3]; /* [-] unit vector into the ground, world */
    double tilt;      /* [-] length of its horizontal part */
    Cubic f[3];       /* the polynomials at that normal */
} Plate;

static Plate plate_of(const double *rotation) {
    double side = rotation[8] > 0.0 ? -1.0 : 1.0; /* the face of the sole that points down */
    Plate plate = {
        .normal = {side * rotation[2], side * rotation[5], real_min(side * rotation[8], -1e-6)}};
    plate.tilt =
        sqrt(plate.normal[0] * plate.normal[0] + plate.normal[1] * plate.normal[1]) + ELEMENT_TINY;
    for (int k = 0; k < 3; k++) {
        cubic_at(space_coefficients[k], -plate.normal[2], plate.f[k]);
    }
    return plate;
}

/* Coefficients against the heading and upward, for motion at the horizontal speed `level` and the
 * downward speed `down`. lean: component of the normal along the heading. in_space: bool, use the
 * 3D theory. */
ALWAYS_INLINE Alpha plate_alpha(const Plate *plate, int in_space, double lean, double level,
                                double down) {
    const double scale = 1.0 / sqrt(level * level + down * down);
    const double c = level * scale;
    const double s = down * scale;
    if (!in_space) {
        const double slope = lean * (-1.0 / plate->normal[2]);
        const double whole = 1.0 / (1.0 + slope * slope);
        return plane_alpha((1.0 - slope * slope) * whole, 2.0 * slope * whole, c, s);
    }
    const double z = lean * c - plate->normal[2] * s;
    const double faces = z < 0.0 ? 0.0 : 1.0 / RESIST_LEVEL;
    const double f1 = cubic(plate->f[0], s, z);
    const double f2 = cubic(plate->f[1], s, z);
    const double f3 = cubic(plate->f[2], s, z);
    return (Alpha){-faces * (f1 * lean + f2 * c), faces * (f1 * plate->normal[2] - f2 * s - f3)};
}

/* Adapts the law of an element to the direction of motion, after element_begin. strength: [N/m]
 * slope for a level plate moving straight down. sideways, downward: coefficients [-] against the
 * heading and up. */
ALWAYS_INLINE void element_resist(Element *e, const ElementMemory *memory, double dt, double rate,
                                  double strength, double sideways, double downward, int curves) {
    /* The line of the peak starts deeper than the element has been. */
    const double peak = RESIST_PEAK * strength;
    const double share = real_min(real_max(downward / RESIST_PEAK, 0.0), 1.0);
    const double lead = ELEMENT_ELASTIC * (1.0 - share);
    const double led =
        e->middle > 0.0 ? real_min(e->middle + lead, e->middle / (share + ELEMENT_TINY)) : 0.0;
    const double b = real_max(led, e->virgin_depth);

    const double bed = law_bed_force(&e->law, b);
    const double peak_force = peak * b + bed;
    const double yield_force = share * peak * b + bed;
    const double travel = real_min(ELEMENT_ELASTIC, b) + ELEMENT_TINY;
    const double line = real_max(peak_force / travel, peak + law_bed_slope(&e->law, b));
    const double inverse = 1.0 / line;
    e->law.line_stiffness = share * peak;
    e->virgin_depth = b;
    e->unload_stiffness = line;
    e->zero_depth = b - peak_force * inverse;
    e->yield_depth = e->zero_depth + yield_force * inverse;
    e->yield_speed = real_max(2.0 * (e->yield_depth - e->depth) * rate, 0.0);

    e->drift_bound += dt * strength * real_max(sideways, 0.0) * real_max(e->depth, 0.0);
    const double held = yield_force + law_elastic_force(&e->law, curves, e->middle);
    friction_hold(e, memory, dt, rate, held);
}

/* Adapts the law of one slot to its motion at the start of the step. */
ALWAYS_INLINE void slot_resist(const Slots *s, int i, double dt, double rate, const Plate *plate,
                               const Motion *motion, int in_space, int curves) {
    const SlotVelocity v = slot_velocity(s, i, motion, 1);
    const double down = real_max(v.descent, 0.0);

    /* The heading is that of the motion plus RESIST_REST along the tilt. If both vanish the plate
     * is level, and every heading gives the same result. */
    const double rest = RESIST_REST / plate->tilt;
    const double hx = v.x + rest * plate->normal[0];
    const double hy = v.y + rest * plate->normal[1];
    const double scale = 1.0 / (sqrt(hx * hx + hy * hy) + ELEMENT_TINY);
    const double lean = (plate->normal[0] * hx + plate->normal[1] * hy) * scale;

    const double moves = sqrt(v.x * v.x + v.y * v.y);
    const double level = moves * FRICTION_LAG < 1.0 ? 0.0 : moves; /* friction may still hold it */
    const Alpha sinking = plate_alpha(plate, in_space, lean, level, down + RESIST_REST);
    const Alpha sliding = plate_alpha(plate, in_space, lean, level + RESIST_REST, down);

    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    element_resist(&element, &memory, dt, rate, s->strength[i], sliding.x, sinking.z, curves);
    s->line_stiffness[i] = element.law.line_stiffness;
    slot_store(s, i, &element);
}

/* The same for slots start .. end - 1. */
ALWAYS_INLINE void slots_resist(const Slots *slot, int start, int end, double dt, const Plate *sole,
                                const Motion *now, int in_space, int curves) {
    const Slots local = *slot, *s = &local;
    const Plate plate = *sole;
    const Motion motion = *now;
    const double rate = 1.0 / dt;
#pragma omp simd
    for (int i = start; i < end; i++) {
        slot_resist(s, i, dt, rate, &plate, &motion, in_space, curves);
    }
}

/* Bool: all materials of the terrain are of this model. */
static int terrain_only(const MildTerrain *terrain, int model) {
    int only = 1;
    for (int m = 0; m < terrain->material_count; m++) {
        only &= terrain->materials[m].model == model;
    }
    return only;
}

/* The foot's slots on `model`. in_space: bool, a constant. */
ALWAYS_INLINE void foot_resist(const FootScratch *foot, const MildTerrain *terrain, int model,
                               double dt, const double *rotation, const Motion *now, int in_space) {
    const Slots *s = &foot->slot;
    const Plate plate = plate_of(rotation);
    if (terrain_only(terrain, model)) {
        slots_resist(s, 0, foot->active, dt, &plate, now, in_space, LAW_LINE);
        return;
    }
    for (int i = 0; i < foot->active; i++) {
        if (terrain->materials[foot->slot_material[i] & 0xff].model != model) {
            continue; /* the nearer material decides */
        }
        if (s->flat_stiffness[i] != 0.0 || s->power_force[i] != 0.0) {
            continue; /* blended with another curve: stays a level plate */
        }
        slots_resist(s, i, i + 1, dt, &plate, now, in_space, foot->curves);
    }
}

void resist_plane(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                  const double *rotation, const Motion *now) {
    foot_resist(foot, terrain, model, dt, rotation, now, 0);
}

void resist_space(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                  const double *rotation, const Motion *now) {
    foot_resist(foot, terrain, model, dt, rotation, now, 1);
}

Law resist_law(const MildMaterial *material, double pitch) {
    const double area = pitch * pitch;
    return law_line(material->zeta * LAW_RESIST_STRESS * area, area, material->bed_depth);
}

void resist_material(MildMaterial *material, double area) {
    (void)area;
    material->zeta = 1.0;
    material->recovery = 0.0;
    material->mu = material->k_drift = material->b_drift = 0.0;
}
