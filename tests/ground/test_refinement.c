/* The same ground on finer grids: pitch 39, 19.5, 9.75 and 4.875 mm. A material's numbers
 * belong to an element of the paper's pitch, so it is the same per area and per depth at any. What
 * converges is the footprint: the sum over elements is the midpoint rule of an integral over the
 * sole. docs/model.md, section 16. */
#include "ground_kit.h"

#include "ground/law/models.h"

enum { LEVELS = 4 };
static const double pitches[LEVELS] = {0.039, 0.0195, 0.00975, 0.004875};

static const double length = 0.234, width = 0.156; /* [m] whole elements at every pitch */

static void tilt(Kit *kit, double angle) {
    double turn[3] = {0.0, angle, 0.0};
    kit_rotate(kit->input.rotation[0],
               turn); /* about the plate's centre: the ankle moves on a circle */
    kit->input.position[0][0] = -kit->input.rotation[0][2] * KIT_SOLE_Z;
    kit->input.position[0][2] = -kit->input.rotation[0][8] * KIT_SOLE_Z;
}

/* Force and moment about the plate's centre after it has gone down to `depth` at a walking foot's
 * speed and stopped. */
static void press(const MildMaterial *m, double pitch, double angle, double depth, double *force,
                  double *moment) {
    MildSole *sole = kit_rectangle(length, width, pitch, 0);
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, 1e-3);
    tilt(&kit, angle);
    double above = 0.5 * length * sin(fabs(angle)), step = 1e-4;
    kit.input.position[0][2] += above;
    int steps = (int)((above + depth) / step + 0.5);
    for (int s = 0; s < steps + 2; s++) { /* the added mass comes to rest in the last two */
        kit.input.velocity[0][2] = kit.input.free_velocity[2] =
            s < steps ? -(above + depth) / steps / kit.input.dt : 0.0;
        kit_solve(&kit);
        kit_advance(&kit);
    }
    const MildFootResult *foot = &kit.result.foot[0];
    double x = kit.input.rotation[0][2] * KIT_SOLE_Z, z = kit.input.rotation[0][8] * KIT_SOLE_Z;
    *force = foot->force[2];
    *moment = foot->torque[1] - (z * foot->force[0] - x * foot->force[2]);
    kit_close(&kit);
    mild_sole_destroy(sole);
}

/* The limit of small elements: integral of stress over the part of the plate that is in the ground.
 */
static void limit(const MildMaterial *m, double angle, double depth, double *force,
                  double *moment) {
    enum { PANELS = 200000 };
    double dx = length / PANELS;
    *force = *moment = 0.0;
    for (int i = 0; i < PANELS; i++) {
        double x = -0.5 * length + (i + 0.5) * dx, u = depth + x * sin(angle);
        if (u <= 0.0) {
            continue;
        }
        double f = mild_element_law(m, KIT_PITCH, u).force / (KIT_PITCH * KIT_PITCH) * width * dx;
        *force += f;
        *moment -= x * cos(angle) * f;
    }
}

/* Every model but the concentric ones: the plate carries and moves the same at any pitch, and drift
 * costs as much. The heap of a merged sole is a mean over cells. */
TEST(test_models) {
    const double load = 300.0, depth = 0.012;
    MildMaterial sand = kit_preset("sand_loose");
    for (int model = 0; model < MILD_MODELS; model++) {
        if (mild_model_is_concentric((MildModel)model) || model == MILD_MODEL_RIGID) {
            continue;
        }
        double force[LEVELS], drift[LEVELS], worst = 0.0;
        for (int k = 0; k < LEVELS; k++) {
            MildSole *sole = kit_rectangle(length, width, pitches[k], 0),
                     *usual = kit_rectangle(length, width, KIT_PITCH, 0);
            MildMaterial own;
            MildError error = {0};
            assert_int_equal(mild_model_match((MildModel)model, &sand, usual, load, &own, &error),
                             MILD_OK);
            const MildElementLaw law = mild_sole_law(&own, sole, depth);
            const MildMaterial each = material_at(&own, pitches[k]);
            force[k] = law.force + 1e3 * law.added_mass;
            drift[k] = mild_sole_elements(sole) * (each.k_drift + 1e3 * each.b_drift);
            mild_sole_destroy(sole);
            mild_sole_destroy(usual);
            worst = fmax(worst, fabs(force[k] / force[0] - 1.0));
            worst = fmax(worst, fabs(drift[k] - drift[0]) / (drift[0] + 1e-9));
        }
        expect_below(mild_model_names[model], worst, model == MILD_MODEL_MILD_MERGED ? 0.02 : 1e-9);
    }
}

TEST(test_tilted) {
    static const char *const grounds[3] = {"sand_loose", "foam45", "rubber"};
    static const double angle = 5.0 * 3.14159265358979 / 180.0, depths[3] = {-0.004, 0.002, 0.010};
    double worst[LEVELS] = {0};
    for (int g = 0; g < 3; g++) {
        for (int d = 0; d < 3; d++) {
            MildMaterial base = kit_preset(grounds[g]);
            double wanted, turn;
            limit(&base, angle, depths[d], &wanted, &turn);
            for (int k = 0; k < LEVELS; k++) {
                double force, moment;
                press(&base, pitches[k], angle, depths[d], &force, &moment);
                worst[k] = fmax(worst[k], 100.0 * fabs(force / wanted - 1.0));
                worst[k] = fmax(worst[k], 100.0 * fabs(moment / turn - 1.0));
            }
        }
    }
    print_message("tilted by 5 degrees, off by %.2f %.2f %.2f %.2f %%\n", worst[0], worst[1],
                  worst[2], worst[3]);
    for (int k = 1; k < LEVELS; k++) {
        assert_true(worst[k] < 0.5 * worst[k - 1]);
    }
    assert_true(worst[3] < 0.1);
}

/* A sole of this outline that chooses its pitch has the outline's area, and about its levers. */
static void own_pitch(const char *name, const double *outline, int points) {
    double area = 0, first[2] = {0, 0}, second[2] = {0, 0}, mean[2] = {0, 0}, square[2] = {0, 0};
    const MildSoleDef def = {outline, points, 0, 0, 0};
    MildSole *sole = mild_sole_create(&def, NULL);
    assert_non_null(sole);
    const int count = mild_sole_elements(sole);
    const double pitch = mild_sole_pitch(sole);
    for (int i = 0; i < points; i++) { /* triangles from the origin */
        const double *a = &outline[2 * i], *b = &outline[2 * ((i + 1) % points)];
        const double part = 0.5 * (a[0] * b[1] - b[0] * a[1]);
        area += part;
        for (int k = 0; k < 2; k++) {
            first[k] += part * (a[k] + b[k]) / 3;
            second[k] += part * (a[k] * a[k] + a[k] * b[k] + b[k] * b[k]) / 6;
        }
    }
    for (int e = 0; e < count; e++) {
        const double at[2] = {mild_sole_x(sole)[e], mild_sole_y(sole)[e]};
        for (int k = 0; k < 2; k++) {
            mean[k] += at[k] / count;
            square[k] += (at[k] * at[k] + pitch * pitch / 12) / count;
        }
    }
    expect_near(name, count * pitch * pitch, fabs(area), 1e-9 * fabs(area));
    assert_true(pitch > 0.0195 / 2 && pitch < 0.0195 * 1.2);
    for (int k = 0; k < 2; k++) {
        const double lever = sqrt(second[k] / area - first[k] / area * (first[k] / area));
        const double own = sqrt(square[k] - mean[k] * mean[k]);
        assert_true(fabs(own / lever - 1) < 0.09 && fabs(mean[k] - first[k] / area) < pitch / 2);
    }
    mild_sole_destroy(sole);
}

/* A foot of two half discs, its length between their centres [m]; 0: a round foot. */
static void own_pitch_round(const char *name, double length_between, double radius) {
    double outline[2 * 32];
    for (int i = 0; i < 32; i++) {
        const double angle = 2 * 3.14159265358979 * (i + 0.5) / 32;
        outline[2 * i] = radius * cos(angle) + (cos(angle) > 0 ? length_between : 0);
        outline[2 * i + 1] = radius * sin(angle);
    }
    own_pitch(name, outline, 32);
}

/* Feet of public robots, and boxes of no kind. */
TEST(test_own_pitch) {
    static const double boxes[][2] = {{0.08, 0.05},  {0.1, 0.1},     {0.25, 0.125}, {0.287, 0.1},
                                      {0.2, 0.012},  {0.03, 0.03},   {0.011, 0.01}, {0.181, 0.067},
                                      {0.31, 0.021}, {0.555, 0.333}, {0.066, 0.19}, {0.04, 0.017}};
    static const double corner[] = {0, 0, 0.2, 0, 0.2, 0.05, 0.05, 0.05, 0.05, 0.15, 0, 0.15};
    for (size_t i = 0; i < sizeof boxes / sizeof *boxes; i++) {
        const double x = boxes[i][0] / 2, y = boxes[i][1] / 2;
        const double outline[] = {-x, -y, x, -y, x, y, -x, y};
        char name[32];
        snprintf(name, sizeof name, "box %g x %g", 2e3 * x, 2e3 * y);
        own_pitch(name, outline, 4);
    }
    own_pitch("corner", corner, 6);
    own_pitch_round("H1", 0.21, 0.03);
    own_pitch_round("G1", 0.17, 0.03);
    own_pitch_round("Go1", 0, 0.023);
    own_pitch_round("Spot", 0, 0.036);
}

TEST_MAIN(NULL, NULL)
