/* The plugin's sensor against MuJoCo's own generalised forces, and against the weight and the place
 * of what stands still. */
#include <math.h>

#include "plugin/plugin.h"
#include "plugin_kit.h"

#define GRAVITY 9.81
#define SENSOR "<sensor><plugin name='feet' plugin='mild.ground' instance='soft'/><clock/></sensor>"
#define MOTOR                                                                                      \
    "<actuator><motor joint='other'/></actuator>" /* so that MuJoCo has a stage of actuation */
enum { FORCE = 0, TORQUE = 3, PRESSURE = 6, AREA = 9, DEEPEST = 10, MEAN = 11 };

/* Two plates of 2 and 5 kg, the second with its mass 20 mm in front of its middle; `feet` names
 * them. */
static mjModel *plates(const char *feet, const char *more) {
    char head[1000], text[3000];
    kit_head(head, sizeof head, 0.002, "implicitfast", feet, "foam45", "");
    snprintf(text, sizeof text,
             "%s<worldbody><body name='light' pos='0 1 0.012'><freejoint/><geom type='box' "
             "size='0.1 0.05 0.01' mass='2' contype='0' conaffinity='0'/></body>"
             "<body name='heavy' pos='0.5 0 0.03' euler='0 2 40'><freejoint/><inertial mass='5' "
             "pos='0.02 0 0' diaginertia='0.02 0.02 0.03'/><geom type='box' size='0.1 0.05 0.01' "
             "contype='0' conaffinity='0'/></body><body pos='0 -9 9'><joint name='other'/>"
             "<geom size='0.1' mass='1' contype='0' conaffinity='0'/></body></worldbody>%s"
             "</mujoco>",
             head, more);
    return kit_model(text);
}

static const mjtNum *reading(const mjModel *m, const mjData *d, int foot) {
    return d->sensordata + m->sensor_adr[0] + (ptrdiff_t)(SENSOR_NUMBERS * foot);
}

/* A free joint's generalised force is force and, in the body's axes, torque about its origin. */
TEST(readings_are_the_forces) {
    for (int motor = 0; motor < 2; motor++) {
        mjModel *m = plates("light heavy", motor ? SENSOR MOTOR : SENSOR);
        mjData *d = mj_makeData(m);
        double worst = 0, most = 0;
        assert_int_equal(m->sensor_dim[0], 2 * SENSOR_NUMBERS);
        mj_step(m, d);
        for (int i = 0; i < 2 * SENSOR_NUMBERS; i++) {
            assert_true(d->sensordata[i] == 0); /* both are in the air */
        }
        for (int i = 0; i < 600; i++) {
            mj_step(m, d);
            for (int foot = 0; foot < 2; foot++) {
                const mjtNum *found = reading(m, d, foot), *wanted = d->qfrc_passive + 6 * foot;
                mjtNum torque[3];
                mju_mulMatTVec3(torque, d->xmat + 9 * (foot + 1), found + TORQUE);
                for (int k = 0; k < 3; k++) {
                    worst = fmax(worst, fabs(found[FORCE + k] - wanted[k]));
                    worst = fmax(worst, fabs(torque[k] - wanted[3 + k]));
                    most = fmax(most, fabs(found[TORQUE + k]));
                }
            }
        }
        print_message(
            "%s: readings and generalised forces apart by %.1e, largest torque %.2f N m\n",
            motor ? "with a motor" : "without", worst, most);
        assert_true(worst < 1e-10 && most > 0.5);
        mj_deleteData(d);
        mj_deleteModel(m);
    }
}

/* Plates at rest, named in the other order. */
TEST(at_rest_it_is_the_weight) {
    mjModel *m = plates("heavy light", SENSOR MOTOR);
    mjData *d = mj_makeData(m);
    kit_run(m, d, 6);
    const mjtNum *heavy = reading(m, d, 0), *light = reading(m, d, 1);
    const double depth = 0.01 - d->qpos[2], *mass = d->xipos + 6; /* of 2 kg; place of 5 kg */
    const double beside[2] = {heavy[PRESSURE] - mass[0], heavy[PRESSURE + 1] - mass[1]};
    print_message("forces %.4f and %.4f N; 2 kg %.4f to %.4f mm deep, by its height %.4f; pressure "
                  "beside 5 kg by %.2f, %.2f mm\n",
                  heavy[2], light[2], 1e3 * light[MEAN], 1e3 * light[DEEPEST], 1e3 * depth,
                  1e3 * beside[0], 1e3 * beside[1]);
    assert_true(fabs(heavy[2] - 5 * GRAVITY) < 1e-2 && fabs(light[2] - 2 * GRAVITY) < 1e-2);
    assert_true(fabs(beside[0]) < 1e-3 && fabs(beside[1]) < 1e-3);
    assert_true(fabs(light[MEAN] - depth) < 1e-6 && fabs(light[DEEPEST] - depth) < 1e-6);
    assert_true(heavy[DEEPEST] > 1.2 * heavy[MEAN]); /* its mass is in front */
    assert_true(fabs(light[AREA] - 0.2 * 0.1) < 1e-12);
    assert_true(fabs(d->sensordata[m->sensor_adr[1]] - d->time) <
                2.1e-3); /* the next one is whole */
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* Two bodies that are alike, of which the second has its frame turned, and shifted by `shift`, and
 * a site that undoes that. The mass is in front and to the left, so that each axis counts. */
static mjModel *twins(const double turn[4], const double shift[3]) {
#define SHAPE                                                                                      \
    "<geom type='box' size='0.1 0.05 0.01' mass='1' contype='0' conaffinity='0'/><geom "           \
    "type='box' pos='0.03 0.02 0.04' size='0.02 0.01 0.01' mass='4' contype='0' conaffinity='0'/>"
    char head[1000], text[3000];
    kit_head(head, sizeof head, 0.002, "implicitfast", "plain turned", "sand_loose",
             CONFIG("ground.model", "mild"));
    snprintf(text, sizeof text,
             "%s<worldbody><body name='plain' pos='0 0 0.015'><freejoint/>" SHAPE
             "</body><body name='other'><freejoint/><frame pos='%g %g %g' quat='%g %g %g "
             "%g'>" SHAPE "<site name='turned'/></frame></body></worldbody>%s</mujoco>",
             head, shift[0], shift[1], shift[2], turn[0], -turn[1], -turn[2], -turn[3], SENSOR);
    return kit_model(text);
}

/* Dropped alike, 1 m apart, they read the same: where the body's origin is shifted, too, for the
 * steps in which MuJoCo integrates the two alike. */
TEST(a_site_may_be_turned) {
    const double turn[4] = {0.5, 0.1, -0.7, 0.5}, shifts[2][3] = {{0}, {0.04, -0.03, 0.02}};
    for (int shifted = 0; shifted < 2; shifted++) {
        mjModel *m = twins(turn, shifts[shifted]);
        mjData *d = mj_makeData(m);
        mjtNum arm[3], worst = 0, most = 0;
        mju_rotVecQuat(arm, shifts[shifted], turn);
        mju_sub3(d->qpos + 7, d->qpos, arm);
        d->qpos[8] += 1;
        mju_copy4(d->qpos + 10, turn);
        for (int i = 0; i < (shifted ? 18 : 300); i++) {
            mj_step(m, d);
            const mjtNum *plain = reading(m, d, 0), *turned = reading(m, d, 1);
            for (int k = 0; k < SENSOR_NUMBERS; k++) {
                const double apart = k == PRESSURE + 1 && plain[AREA] > 0 ? 1 : 0;
                worst = fmax(worst, fabs(turned[k] - plain[k] - apart));
            }
            most = fmax(most, fabs(plain[TORQUE + 1]));
        }
        print_message("a foot and a turned one differ by %.1e, torques to %.2f N m\n", worst, most);
        assert_true(worst < (shifted ? 1e-2 : 1e-6) && most > 0.5);
        mj_deleteData(d);
        mj_deleteModel(m);
    }
}

TEST_MAIN(kit_setup, NULL)
