/* What a step reports of a foot: where the wrench acts, in world axes, with every sign. */
#include "ground_kit.h"

/* A single element at (x, y) of the sole, the foot turned, tilted and shifted: all force acts at
 * that element's centre, wherever the ankle is. */
static MildSole *element_at(double x, double y) {
    double h = 0.5 * KIT_PITCH,
           outline[8] = {x - h, y - h, x + h, y - h, x + h, y + h, x - h, y + h};
    return kit_sole_of(outline, 4, KIT_PITCH, 1);
}

static double gap(const double *ours, const double *expected, int count) {
    double worst = 0.0;
    for (int k = 0; k < count; k++) {
        worst = fmax(worst, fabs(ours[k] - expected[k]));
    }
    return worst;
}

TEST(test_one_element_carries_all) {
    static const double place[4][2] = {{0.08, 0.03}, {-0.05, 0.04}, {0.07, -0.05}, {-0.06, -0.02}};
    static const double turn[3][3] = {{0, 0, 0}, {0, 0, 2.0}, {0.1, -0.15, 0.7}};
    MildMaterial sand = mild_material_default();
    double worst = 0.0, least = 1.0;
    for (int p = 0; p < 4; p++) {
        MildSole *sole = element_at(place[p][0], place[p][1]);
        for (int t = 0; t < 3; t++) {
            Kit kit;
            kit_open(&kit, 1, sole, NULL, &sand, 1e-3);
            kit_rotate(kit.input.rotation[0], turn[t]);
            const double *R = kit.input.rotation[0],
                         local[3] = {mild_sole_x(sole)[0], mild_sole_y(sole)[0], KIT_SOLE_Z};
            double *at = kit.input.position[0], arm[3];
            for (int k = 0; k < 3; k++) {
                arm[k] = R[3 * k] * local[0] + R[3 * k + 1] * local[1] + R[3 * k + 2] * local[2];
            }
            at[0] = 1.5, at[1] = -0.7, at[2] = -arm[2] + 1e-6;
            /* down into the ground and aside, so that there is friction; the foot is immovable */
            kit.input.velocity[0][0] = kit.input.free_velocity[0] = 0.3;
            kit.input.velocity[0][1] = kit.input.free_velocity[1] = -0.2;
            kit.input.velocity[0][2] = kit.input.free_velocity[2] = -5.0;
            kit_solve(&kit);
            const MildFootResult *r = &kit.result.foot[0];
            const double *F = r->force;
            assert_true(F[2] > 1.0 && F[0] < -0.05 * F[2] && F[1] > 0.05 * F[2]);
            double torque[3], axis[3], square = F[0] * F[0] + F[1] * F[1] + F[2] * F[2],
                                       along = (arm[0] * F[0] + arm[1] * F[1] + arm[2] * F[2]);
            kit_cross(arm, F, torque);
            worst = fmax(worst, gap(r->torque, torque, 3) / F[2]);
            worst = fmax(worst, gap(r->zmp_sole, arm, 2)); /* the centre is on the sole's plane */
            for (int k = 0; k < 3; k++) { /* the line through the element, where nearest */
                axis[k] = arm[k] - along / square * F[k];
            }
            worst = fmax(worst, gap(r->zmp_axis, axis, 3));
            const double center[3] = {at[0] + arm[0], at[1] + arm[1], at[2] + arm[2]};
            worst = fmax(worst, gap(r->pressure_center, center, 3));
            least = fmin(least, fmin(fabs(arm[0]), fabs(arm[1])));
            assert_int_equal(r->contacts, 1);
            assert_true(fabs(r->area - KIT_PITCH * KIT_PITCH) < 1e-12);
            kit_close(&kit);
        }
        mild_sole_destroy(sole);
    }
    expect_below("zero moment points, pressure centre, torque of one element", worst, 1e-9);
    assert_true(least > 1e-3);
}

/* Many elements, tilted so that some are loaded: about zmp_sole, which lies in the height of the
 * sole's centre, the wrench has no horizontal torque; about zmp_axis only one along the force. */
TEST(test_zmp_takes_the_horizontal_torque) {
    uint64_t random = 31;
    MildSole *sole = kit_sole(0, 77);
    double worst = 0.0, center[3] = {0.0, 0.0, KIT_SOLE_Z};
    int loaded = 0;
    for (int e = 0; e < 77; e++) {
        center[0] += mild_sole_x(sole)[e] / 77;
        center[1] += mild_sole_y(sole)[e] / 77;
    }
    for (int draw = 0; draw < 200; draw++) {
        MildMaterial m = kit_material(&random);
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        double turn[3] = {kit_uniform(&random, -0.2, 0.2), kit_uniform(&random, -0.2, 0.2),
                          kit_uniform(&random, -3.0, 3.0)};
        kit_rotate(kit.input.rotation[0], turn);
        kit.input.position[0][2] += kit_uniform(&random, -0.02, 0.0);
        for (int k = 0; k < 3; k++) {
            kit.input.velocity[0][k] = kit.input.free_velocity[k] = kit_uniform(&random, -0.5, 0.0);
        }
        kit_solve(&kit);
        const MildFootResult *r = &kit.result.foot[0];
        const double *R = kit.input.rotation[0], *F = r->force;
        if (F[2] > 1.0) {
            double height = R[6] * center[0] + R[7] * center[1] + R[8] * center[2], moment[3],
                   point[3] = {r->zmp_sole[0], r->zmp_sole[1], height};
            kit_cross(point, F, moment);
            worst = fmax(worst, gap(r->torque, moment, 2) / F[2]);
            kit_cross(r->zmp_axis, F, moment);
            double twist[3], left[3] = {r->torque[0] - moment[0], r->torque[1] - moment[1],
                                        r->torque[2] - moment[2]};
            kit_cross(left, F, twist);
            const double zero[3] = {0};
            worst = fmax(worst, gap(twist, zero, 3) / (F[2] * F[2]));
            loaded++;
        }
        kit_close(&kit);
    }
    expect_below("torque that is left, by the force [m]", worst, 1e-9);
    assert_true(loaded > 100);
    mild_sole_destroy(sole);
}

/* Depths, area and count are those of the loaded elements. */
TEST(test_depths_of_the_loaded_elements) {
    MildSole *sole = kit_plate(4, 1);
    MildMaterial sand = mild_material_default();
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &sand, 1e-3);
    double turn[3] = {0, asin(0.5), 0}; /* pitched by 30 degrees: a column is 9.75 mm deeper */
    kit_rotate(kit.input.rotation[0], turn);
    const double *R = kit.input.rotation[0];
    double step = 0.5 * KIT_PITCH, speed = 0.01;
    /* the second element from below is 4 mm deep, the third 5.75 mm above the ground */
    kit.input.position[0][2] = -R[8] * KIT_SOLE_Z + 0.5 * step - 0.004;
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -speed;
    kit_solve(&kit);
    const MildFootResult *r = &kit.result.foot[0];
    assert_int_equal(r->contacts, 2);
    assert_true(fabs(r->area - 2 * KIT_PITCH * KIT_PITCH) < 1e-12);
    double move = speed * 1e-3; /* depths of the step's start or end */
    assert_true(fabs(r->depth_max - (0.004 + step)) <= move + 1e-12);
    assert_true(fabs(r->depth_mean - (0.004 + 0.5 * step)) <= move + 1e-12);
    kit.input.position[0][2] += 1.0; /* in the air all is zero */
    kit_solve(&kit);
    static const MildFootResult zero;
    assert_memory_equal(r, &zero, sizeof zero);
    kit_close(&kit);
    mild_sole_destroy(sole);
}

/* Forces whose square is 0 or infinite, and torques beside next to no force, have a finite axis. */
TEST(test_axis_is_finite) {
    MildSole *sole = kit_sole(0, 77);
    uint64_t random = 3;
    int loaded = 0;
    for (int draw = 0; draw < 3000; draw++) {
        MildMaterial m = kit_material(&random);
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        kit.input.position[0][2] -= pow(10.0, kit_uniform(&random, -320.0, -2.0));
        double *V = kit.input.free_velocity; /* led by hand */
        for (int k = 0; k < 6; k++) {
            V[k] = kit_uniform(&random, -1.0, 1.0) * pow(10.0, kit_uniform(&random, -320.0, 200.0));
        }
        kit_solve(&kit);
        const MildFootResult *r = &kit.result.foot[0];
        double sum = 0.0 * (r->zmp_sole[0] + r->zmp_sole[1]);
        for (int k = 0; k < 3; k++) {
            sum += 0.0 * r->zmp_axis[k] + 0.0 * r->pressure_center[k] + 0.0 * r->force[k];
        }
        assert_true(!kit.result.converged || sum == 0.0);
        loaded += kit.result.converged && r->contacts > 0;
        kit_close(&kit);
    }
    mild_sole_destroy(sole);
    assert_true(loaded > 300);
}

TEST_MAIN(NULL, NULL)
