/* What the ground's tests share: the reference soles, random materials, a free rigid body on each
 * foot. */
#ifndef GROUND_KIT_H
#define GROUND_KIT_H

#include "draws.h"
#include "materials.h"
#include "sa01.h"

#define KIT_PITCH 0.0195
#define KIT_SOLE_Z (-0.055)
#define KIT_GRAVITY 9.81

/* Draws of a random test: `count`, or the share of it in MILD_TEST_DRAWS, which scripts/mutants.py
 * sets: a fault that random states show at all, few of them show. */
static inline int kit_draws(int count) {
    const char *share = getenv("MILD_TEST_DRAWS");
    double some = share ? count * atof(share) : count;
    return some < 1.0 ? 1 : (int)some;
}

/* Time that a test waits for a drift [s]: all of it, or the share in MILD_TEST_DRAWS. */
static inline double kit_seconds(double time) {
    const char *share = getenv("MILD_TEST_DRAWS");
    return share ? time * atof(share) : time;
}

/* First of the time steps, from fine to coarse, that a test takes: the finest costs most, and is
 * left out where MILD_TEST_DRAWS is set. */
static inline int kit_finest(void) {
    return getenv("MILD_TEST_DRAWS") != NULL;
}

/* Prints what was measured, and fails unless it is below a bound; NaN fails. */
static inline void expect_below(const char *what, double got, double bound) {
    print_message("%s: %.3g, bound %.3g\n", what, got, bound);
    if (!(got < bound)) {
        fail_msg("%s: %.12g instead of less than %.3g", what, got, bound);
    }
}

static inline void kit_vector(uint64_t *random, double size, double *x) {
    for (int k = 0; k < 3; k++) {
        x[k] = kit_uniform(random, -size, size);
    }
}

/* target: elements that it must have; 0: any. */
static inline MildSole *kit_sole_of(const double *outline, int points, double pitch, int target) {
    const MildSoleDef def = {outline, points, pitch, KIT_SOLE_Z, target};
    MildError error = {0};
    MildSole *sole = mild_sole_create(&def, &error);
    expect_good(sole != NULL, &error);
    return sole;
}

/* A level rectangle [m] under the reference point. */
static inline MildSole *kit_rectangle(double length, double width, double pitch, int target) {
    const double x = 0.5 * length, y = 0.5 * width;
    const double outline[8] = {-x, -y, x, -y, x, y, -x, y};
    return kit_sole_of(outline, 4, pitch, target);
}

/* A level plate of columns x rows elements under the reference point. */
static inline MildSole *kit_plate(int columns, int rows) {
    return kit_rectangle(columns * KIT_PITCH, rows * KIT_PITCH, KIT_PITCH, columns * rows);
}

static inline MildSole *kit_sole(int right, int target) {
    double outline[2 * 38], sign = right ? -1.0 : 1.0;
    for (int i = 0; i < 19; i++) {
        outline[2 * i] = outline[2 * (37 - i)] = sa01_outline[i][0];
        outline[2 * i + 1] = sign * sa01_outline[i][1];
        outline[2 * (37 - i) + 1] = sign * sa01_outline[i][2];
    }
    return kit_sole_of(outline, 38, KIT_PITCH, target);
}

/* Uniform in the paper's Table III. */
static inline MildMaterial kit_material(uint64_t *random) {
    MildMaterial m = mild_material_default();
    m.k_pen = kit_uniform(random, 8.0, 1400.0);
    m.sigma_cone = kit_uniform(random, 0.01e6, 0.24e6);
    m.alpha = kit_uniform(random, 0.698, 1.310);
    m.nu = kit_uniform(random, 0.8, 2.4);
    m.c_g = kit_uniform(random, -1.4, 4.6);
    m.c_d = kit_uniform(random, -6.0, 28.0);
    m.phi = kit_uniform(random, 0.50, 0.64);
    m.rho = kit_uniform(random, 1000.0, 2600.0);
    m.mu = kit_uniform(random, 0.2, 1.3);
    m.k_drift = kit_uniform(random, 100.0, 1000.0);
    m.b_drift = kit_uniform(random, 0.02, 0.1);
    m.recovery = kit_uniform(random, -0.3, 1.3);
    m.recovery =
        m.recovery < 0.0 ? 0.0 : (m.recovery > 1.0 ? 1.0 : m.recovery); /* both ends often */
    m.bed_depth = kit_uniform(random, 0.10, 0.15);
    return m;
}

/* A whole contact problem with its memory. */
typedef struct {
    int feet;
    const MildSole *soles[MILD_FEET_MAX];
    MildScratch *scratch;
    MildGround *ground;
    size_t bytes;
    MildTerrain terrain;
    MildContactInput input;
    double A[36 * MILD_FEET_MAX * MILD_FEET_MAX]; /* of the input */
    MildContactResult result;
    double mass[MILD_FEET_MAX], inertia[MILD_FEET_MAX],
        center[MILD_FEET_MAX][3]; /* body on each foot: kg, kg m^2, [m] foot frame */
} Kit;

static inline void kit_open(Kit *kit, int feet, MildSole *left, MildSole *right,
                            const MildMaterial *material, double dt) {
    memset(kit, 0, sizeof *kit);
    kit->feet = feet;
    for (int f = 0; f < feet; f++) {
        kit->soles[f] = f % 2 ? right : left;
    }
    MildError error = {0};
    kit->scratch = mild_scratch_create(kit->soles, feet, &error);
    expect_good(kit->scratch != NULL, &error);
    kit->bytes = mild_ground_bytes(kit->soles, feet);
    kit->ground = mild_ground_init(aligned_alloc(64, kit->bytes), kit->soles, feet);
    kit->terrain = mild_terrain_uniform(material);
    kit->input.feet = feet;
    kit->input.dt = dt;
    kit->input.inverse_inertia = kit->A;
    for (int f = 0; f < feet; f++) {
        for (int k = 0; k < 3; k++) {
            kit->input.rotation[f][4 * k] = 1.0;
        }
        kit->input.position[f][1] = f ? -0.1 : 0.1;
        kit->input.position[f][2] = -KIT_SOLE_Z;
        kit->mass[f] = 20.0;
        kit->inertia[f] = 0.5;
    }
}

/* Other soles, [feet], than those of kit_open. */
static inline void kit_soles(Kit *kit, const MildSole *const *soles) {
    MildError error = {0};
    memcpy(kit->soles, soles, (size_t)kit->feet * sizeof(const MildSole *));
    mild_scratch_destroy(kit->scratch);
    free(kit->ground);
    kit->scratch = mild_scratch_create(kit->soles, kit->feet, &error);
    expect_good(kit->scratch != NULL, &error);
    kit->bytes = mild_ground_bytes(kit->soles, kit->feet);
    kit->ground = mild_ground_init(aligned_alloc(64, kit->bytes), kit->soles, kit->feet);
}

/* Input and A of another kit. */
static inline void kit_copy_input(Kit *kit, const Kit *from) {
    kit->input = from->input;
    kit->input.inverse_inertia = kit->A;
    memcpy(kit->A, from->A, sizeof kit->A);
}

static inline void kit_same_input(const Kit *kit, const Kit *other) {
    MildContactInput input = other->input;
    input.inverse_inertia = kit->input.inverse_inertia;
    assert_memory_equal(&kit->input, &input, sizeof input);
    assert_memory_equal(kit->A, other->A, sizeof kit->A);
}

/* Ground that remembers prints. */
static inline void kit_prints(Kit *kit, int tiles) {
    free(kit->ground);
    kit->bytes = mild_ground_bytes_imprints(kit->soles, kit->feet, tiles);
    kit->ground =
        mild_ground_init_imprints(aligned_alloc(64, kit->bytes), kit->soles, kit->feet, tiles);
}

static inline void kit_close(Kit *kit) {
    mild_scratch_destroy(kit->scratch);
    free(kit->ground);
}

static inline void kit_cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* World vector ankle -> centre of mass. */
static inline void kit_center(const Kit *kit, int f, double *r) {
    const double *R = kit->input.rotation[f], *c = kit->center[f];
    for (int k = 0; k < 3; k++) {
        r[k] = R[3 * k] * c[0] + R[3 * k + 1] * c[1] + R[3 * k + 2] * c[2];
    }
}

/* A of a free body (ball inertia): wrench at the ankle -> change of twist at the ankle. */
static inline void kit_inverse_inertia(Kit *kit) {
    int n = 6 * kit->feet;
    memset(kit->A, 0, 36 * (size_t)(kit->feet * kit->feet) * sizeof *kit->A);
    kit->input.inverse_inertia = kit->A;
    for (int f = 0; f < kit->feet; f++) {
        double r[3];
        kit_center(kit, f, r);
        for (int k = 0; k < 6; k++) {
            double wrench[6] = {0}, lever[3], turn[3], swing[3];
            wrench[k] = 1.0;
            kit_cross(r, wrench, lever);
            for (int j = 0; j < 3; j++) {
                turn[j] = (wrench[3 + j] - lever[j]) / kit->inertia[f];
            }
            kit_cross(turn, r, swing);
            for (int j = 0; j < 3; j++) {
                kit->input.inverse_inertia[(6 * f + j) * n + 6 * f + k] =
                    wrench[j] / kit->mass[f] - swing[j];
                kit->input.inverse_inertia[(6 * f + 3 + j) * n + 6 * f + k] = turn[j];
            }
        }
    }
}

static inline void kit_rotate(double *R, const double *turn) {
    double angle = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
    if (angle == 0.0) {
        return;
    }
    double x = turn[0] / angle, y = turn[1] / angle, z = turn[2] / angle, c = cos(angle),
           s = sin(angle), t = 1.0 - c;
    const double Q[9] = {t * x * x + c,     t * x * y - s * z, t * x * z + s * y,
                         t * x * y + s * z, t * y * y + c,     t * y * z - s * x,
                         t * x * z - s * y, t * y * z + s * x, t * z * z + c};
    double out[9];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = Q[3 * i] * R[j] + Q[3 * i + 1] * R[3 + j] + Q[3 * i + 2] * R[6 + j];
        }
    }
    memcpy(R, out, sizeof out);
}

/* V_free of free bodies under gravity and a force at the centre of mass [N], gyroscopic terms of a
 * ball being zero. */
static inline void kit_free(Kit *kit, const double force[][3]) {
    for (int f = 0; f < kit->feet; f++) {
        const double *V = kit->input.velocity[f];
        double r[3], spin[3], centripetal[3];
        kit_center(kit, f, r);
        kit_cross(V + 3, r, spin);
        kit_cross(
            V + 3, spin,
            centripetal); /* the ankle's acceleration is the centre's minus omega x (omega x r) */
        for (int k = 0; k < 3; k++) {
            double acceleration =
                (force ? force[f][k] / kit->mass[f] : 0.0) - (k == 2 ? KIT_GRAVITY : 0.0);
            kit->input.free_velocity[6 * f + k] =
                V[k] + kit->input.dt * (acceleration - centripetal[k]);
            kit->input.free_velocity[6 * f + 3 + k] = V[3 + k];
        }
    }
}

static inline void kit_solve(Kit *kit) {
    mild_ground_solve(kit->ground, &kit->terrain, &kit->input, kit->scratch, &kit->result);
}

/* [J] Work of the ground on a foot over the step just solved, at the mean of its twist after and
 * `before`: exactly what the ground's impulses change the kinetic energy by. */
static inline double kit_work(const Kit *kit, int f, const double *before) {
    const MildFootResult *foot = &kit->result.foot[f];
    const double *after = kit->result.velocity + 6 * f;
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        sum += foot->force[k] * (before[k] + after[k]) +
               foot->torque[k] * (before[3 + k] + after[3 + k]);
    }
    return 0.5 * kit->input.dt * sum;
}

/* Leads the one foot of a kit from the twist `last` to another in a step; the pose stays. Returns
 * the ground's work on it [J], and puts the twist into `last`. */
static inline double kit_led(Kit *kit, double last[6], const double twist[6]) {
    memcpy(kit->input.free_velocity, twist, 6 * sizeof *twist);
    memcpy(kit->input.velocity[0], last, 6 * sizeof *last);
    kit_solve(kit);
    const double work = kit_work(kit, 0, last);
    mild_ground_advance(kit->ground, &kit->terrain, &kit->input, kit->scratch, &kit->result);
    memcpy(last, twist, 6 * sizeof *last);
    return work;
}

/* [J] What the ground gives to the one foot of a kit that is led through knots of depth, x, pitch
 * and roll and back to the first, in so many steps from one to the next. rest: [m] height of the
 * foot's frame at the depth 0. *work: the sum of the works' sizes. */
static inline double kit_led_through(Kit *kit, double (*knot)[4], int knots, int parts, double rest,
                                     double *work) {
    const double dt = kit->input.dt;
    double given = 0.0, last[6] = {0};
    *work = 0.0;
    for (int k = 0; k < knots; k++) {
        const double *from = knot[k], *to = knot[(k + 1) % knots];
        for (int i = 0; i < parts; i++) {
            double at[4], rate[4];
            for (int j = 0; j < 4; j++) {
                at[j] = from[j] + (to[j] - from[j]) * i / parts;
                rate[j] = (to[j] - from[j]) / parts / dt;
            }
            /* about y, then x; the pose is set again in each step, which carries it within its own
             * error */
            const double cy = cos(at[2]), sy = sin(at[2]), cx = cos(at[3]), sx = sin(at[3]);
            const double R[9] = {cy, sy * sx, sy * cx, 0, cx, -sx, -sy, cy * sx, cy * cx};
            memcpy(kit->input.rotation[0], R, sizeof R);
            kit->input.position[0][0] = at[1];
            kit->input.position[0][2] = rest - at[0];
            const double twist[6] = {rate[1], 0, -rate[0], rate[3] * cy, rate[2], -rate[3] * sy};
            const double w = kit_led(kit, last, twist);
            given += w;
            *work += fabs(w);
        }
    }
    return given;
}

/* [J] Of the body on the first foot at the foot's twist. */
static inline double kit_kinetic(const Kit *kit, const double *V) {
    double r[3], swing[3], sum = 0.0;
    kit_center(kit, 0, r);
    kit_cross(V + 3, r, swing);
    for (int k = 0; k < 3; k++) {
        const double v = V[k] + swing[k];
        sum += kit->mass[0] * v * v + kit->inertia[0] * V[3 + k] * V[3 + k];
    }
    return 0.5 * sum;
}

/* Bool: no element of the first foot is in the ground or remembers it. */
static inline int kit_lifted(const Kit *kit) {
    int touched = kit->result.foot[0].contacts;
    for (int e = 0; e < mild_sole_elements(kit->soles[0]) && touched == 0; e++) {
        touched += mild_ground_depth_max(kit->ground, 0)[e] > 0.0;
    }
    return touched == 0;
}

/* Semi-implicit, as engines do. */
static inline void kit_advance(Kit *kit) {
    mild_ground_advance(kit->ground, &kit->terrain, &kit->input, kit->scratch, &kit->result);
    for (int f = 0; f < kit->feet; f++) {
        double turn[3];
        memcpy(kit->input.velocity[f], kit->result.velocity + 6 * f, 6 * sizeof(double));
        for (int k = 0; k < 3; k++) {
            kit->input.position[f][k] += kit->input.dt * kit->input.velocity[f][k];
            turn[k] = kit->input.dt * kit->input.velocity[f][3 + k];
        }
        kit_rotate(kit->input.rotation[f], turn);
    }
}

static inline void kit_step(Kit *kit, const double force[][3]) {
    kit_inverse_inertia(kit);
    kit_free(kit, force);
    kit_solve(kit);
    kit_advance(kit);
}

/* Makes the present state of the problem a random one: posture, twist, memory, a coupled inverse
 * inertia of random rank. */
static inline void kit_random_inertia(Kit *kit, uint64_t *random, int rank) {
    int n = 6 * kit->feet;
    static double G[12][12]; /* not beside a Kit: gcc 12 takes it for aligned to 32 bytes there */
    kit_inverse_inertia(kit);
    if (rank >= n && kit->feet == 1) {
        return;
    }
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < rank; k++) {
            G[i][k] = kit_uniform(random, -0.3, 0.3) * (i % 6 >= 3 ? 3.0 : 1.0);
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            double sum = rank < n ? 0.0 : kit->input.inverse_inertia[i * n + j];
            for (int k = 0; k < rank; k++) {
                sum += G[i][k] * G[j][k];
            }
            kit->input.inverse_inertia[i * n + j] = sum;
        }
    }
}

static inline void kit_random_state(Kit *kit, uint64_t *random) {
    for (int f = 0; f < kit->feet; f++) {
        kit->mass[f] = exp(kit_uniform(random, log(1.0), log(40.0)));
        kit->inertia[f] = kit->mass[f] * kit_uniform(random, 0.002, 0.1);
        kit->center[f][0] = kit_uniform(random, -0.05, 0.1);
        kit->center[f][1] = kit_uniform(random, -0.05, 0.05);
        kit->center[f][2] = kit_uniform(random, -0.02, 0.5);
        double tilt = kit_uniform(random, 0.0, 1.0) < 0.3 ? 0.0 : 0.25;
        double turn[3] = {kit_uniform(random, -tilt, tilt), kit_uniform(random, -tilt, tilt),
                          kit_uniform(random, -3.0, 3.0)};
        double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        kit_rotate(R, turn);
        memcpy(kit->input.rotation[f], R, sizeof R);
        double drop =
            R[6] * 0.06 + R[8] * KIT_SOLE_Z; /* height of the sole's middle below the ankle */
        kit->input.position[f][2] = -drop - kit_uniform(random, -0.003, 0.025);
        double fast = kit_uniform(random, 0.0, 1.0) < 0.3 ? 0.01 : 1.0;
        for (int k = 0; k < 3; k++) {
            kit->input.velocity[f][k] = fast * kit_uniform(random, -0.5, 0.5);
            kit->input.velocity[f][3 + k] = fast * kit_uniform(random, -2.0, 2.0);
        }
    }
}

/* First stop [m] from dK/du = (M g - F_g - d w - 2 c_d m_a' K)/(M + m_a), the exact impact
 * equation, by small steps. */
static inline double kit_exact_stop(const MildMaterial *m, const MildSole *sole, double mass,
                                    double speed) {
    const double step = 5e-6;
    double energy = 0.5 * speed * speed, before = energy, u = 0.0;
    for (; energy > 0.0; u += step) {
        before = energy;
        MildElementLaw law = mild_sole_law(m, sole, u + 0.5 * step);
        double drag = 2.0 * m->c_d * law.added_mass_per_depth,
               weight = mass * KIT_GRAVITY - (law.force + law.damping * sqrt(2.0 * energy));
        double inert = mass + law.added_mass;
        energy = (energy * (1.0 - 0.5 * step * drag / inert) + step * weight / inert) /
                 (1.0 + 0.5 * step * drag / inert);
    }
    return u + step * energy / (before - energy); /* within the last step, where nothing is left */
}

/* What a foot showed that was thrown and shaken, over all cycles from touch to lift-off. */
typedef struct {
    int cycles, missed;  /* missed: steps that did not converge */
    double worst, share; /* [J], [-] most energy gained in a cycle, and by the energy exchanged */
    int draw;            /* of the worst */
} Shaken;

/* Shakes the first foot at random for a time: between touch and lift-off the ground takes energy.
 */
static inline void kit_shake(Kit *kit, double seconds, uint64_t *random, int draw, Shaken *all) {
    const double weight = kit->mass[0] * KIT_GRAVITY, spring = kit_uniform(random, 2.0, 8.0);
    double work = 0.0, taken = 0.0, shake[3], force[1][3];
    int missed = 0;
    for (int k = 0; k < 3; k++) {
        shake[k] = kit_uniform(random, 0.0, 1.0);
    }
    for (int s = 0; s < (int)(seconds / kit->input.dt); s++) {
        const double t = s * kit->input.dt;
        double before[6];
        memcpy(before, kit->input.velocity[0], sizeof before);
        for (int k = 0; k < 3; k++) {
            force[0][k] = weight * (k == 2 ? 1.5 * sin(spring * t * 6.28) + 0.8 * shake[2] * t
                                           : shake[k] * sin(20 * t));
        }
        kit_step(kit, (const double(*)[3])force);
        const double w = kit_work(kit, 0, before);
        missed += !kit->result.converged;
        work += w;
        taken += fabs(w);
        if (!kit_lifted(kit) || taken == 0.0) {
            continue;
        }
        all->draw = all->cycles == 0 || work > all->worst ? draw : all->draw;
        all->worst = all->cycles == 0 ? work : fmax(all->worst, work);
        all->share = taken > 1e-6 ? fmax(all->share, work / taken) : all->share;
        all->missed += missed;
        all->cycles++; /* closed */
        work = taken = 0.0;
        missed = 0;
    }
}

static inline void kit_shaken(const char *name, const Shaken *all, int cycles) {
    print_message("%s: %d closed cycles, most energy gained %.2e J (draw %d), %.2e of what was "
                  "exchanged at most; %d steps did not converge\n",
                  name, all->cycles, all->worst, all->draw, all->share, all->missed);
    assert_true(all->cycles > cycles);
    assert_true(all->worst < 1e-9);
}

/* Asserts that motions first .. first + count - 1, from the air to the air, give no energy. motion:
 * [J] what the ground gave; *work: the sum of its works' sizes, for a scale. */
static inline void kit_closed(int first, int count, double (*motion)(int number, double *work)) {
    double worst = -INFINITY, share = -INFINITY;
    int at = 0, gained = 0;
    for (int n = first; n < first + count; n++) {
        double work;
        const double given = motion(n, &work);
        gained += given > 1e-12 * work;
        at = given > worst ? n : at;
        worst = fmax(worst, given);
        share = fmax(share, given / fmax(work, 1e-12));
    }
    print_message(
        "%d closed motions: %d gave energy, at most %.2e J (number %d), %.1e of the work\n", count,
        gained, worst, at, share);
    assert_int_equal(gained, 0);
}

#endif
