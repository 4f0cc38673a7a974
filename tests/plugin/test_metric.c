/* The inertia that the ground counts with is the integrator's: the twists of the feet that the
 * ground expects at the end of a step are those that MuJoCo gives, for every kind of force that an
 * integrator treats implicitly. With another inertia robots with strong feedback become
 * unstable. */
#include "plugin_kit.h"

#include <math.h>

#include "plugin/plugin.h"

#define LEG                                                                                        \
    "<worldbody><body name='trunk' pos='0 0 0.62'><freejoint/><geom name='trunk' "                 \
    "type='box' size='.1 .08 .05' "                                                                \
    "mass='8' contype='0' conaffinity='0'/>"                                                       \
    "<body pos='0 0 -0.05'><joint name='hip' axis='0 1 0' range='-90 90' %s/><geom "               \
    "type='capsule' fromto='0 0 0 0.1 0 -.25' size='.03' mass='.8' contype='0' conaffinity='0'/>"  \
    "<body pos='0.1 0 -0.25'><joint name='knee' axis='0 1 0' range='-2 120' %s/><geom "            \
    "type='capsule' fromto='0 0 0 -0.1 0 -.28' size='.025' mass='.4' contype='0' "                 \
    "conaffinity='0'/>"                                                                            \
    "<body name='foot' pos='-0.1 0 -0.28'><joint name='ankle' axis='0 1 0' range='-60 60' %s/>"    \
    "<geom type='box' size='.11 .08 .01' pos='0.02 0 -.03' mass='.2' contype='0' "                 \
    "conaffinity='0'/></body></body></body></body></worldbody>"
#define PD(kp, kv)                                                                                 \
    "<actuator><position joint='hip' kp='" kp "' kv='" kv "'/><position joint='knee' kp='" kp      \
    "' kv='" kv "'/><position joint='ankle' kp='" kp "' kv='" kv "'/></actuator>"

typedef struct {
    const char *name;
    const char *joints[3]; /* attributes of hip, knee and ankle */
    const char *rest;      /* of the MJCF */
} Case;

static const Case cases[] = {
    {"nothing", {"", "", ""}, ""},
    {"armature", {"armature='.02'", "armature='.02'", "armature='.005'"}, ""},
    {"damping", {"damping='4'", "damping='3'", "damping='2'"}, ""},
    {"polynomials", {"damping='1 2'", "damping='1 0 3'", "stiffness='30 20' damping='0 2'"}, ""},
    {"springs", {"stiffness='60'", "stiffness='90' springref='50'", "stiffness='30'"}, ""},
    {"motors", {"", "", ""}, "<actuator><motor joint='hip'/><motor joint='knee'/></actuator>"},
    {"PD", {"", "", ""}, PD("300", "20")},
    {"strong PD", {"armature='.01'", "", ""}, PD("2000", "100")},
    {"saturated",
     {"", "", "damping='1'"},
     "<actuator><position joint='hip' kp='300' kv='20'/><position joint='knee' kp='300' kv='20' "
     "forcerange='-9 9'/><position joint='ankle' kp='90' kv='9'/></actuator>"},
    {"joint limit of force",
     {"actuatorfrcrange='-8 8'", "", ""},
     "<actuator><position joint='hip' kp='300' kv='20'/><position joint='knee' kp='300' "
     "kv='20'/></actuator>"},
    {"activation",
     {"", "", ""},
     "<actuator><general joint='knee' dyntype='filter' dynprm='.02' gainprm='200' "
     "biastype='affine' biasprm='0 -200 -15'/></actuator>"},
    {"tendon",
     {"", "", ""},
     "<tendon><fixed name='t' stiffness='80' damping='6'><joint joint='hip' coef='1'/><joint "
     "joint='knee' coef='-.7'/></fixed></tendon><actuator><position tendon='t' kp='100' "
     "kv='8'/></actuator>"},
    {"gravity compensation",
     {"actuatorgravcomp='true'", "", ""},
     "<actuator><position joint='hip' kp='200' kv='10'/></actuator>"},
    {"friction", {"frictionloss='2'", "frictionloss='1'", "frictionloss='.5'"}, PD("200", "10")},
    {"friction of a tendon",
     {"", "", ""},
     "<tendon><fixed name='t' frictionloss='3'><joint joint='hip' coef='1'/><joint joint='knee' "
     "coef='-.7'/></fixed></tendon>" PD("90", "4")},
    {"equality",
     {"", "", ""},
     "<equality><joint joint1='knee' joint2='hip' polycoef='0 -1 0 0 0'/></equality>"},
};
enum { CASES = sizeof cases / sizeof *cases };

static mjModel *leg(const Case *c, double dt, const char *integrator, const char *ground) {
    char head[1000], body[4000], text[6000];
    kit_head(head, sizeof head, dt, integrator, "foot", ground, "");
    snprintf(body, sizeof body, LEG, c->joints[0], c->joints[1], c->joints[2]);
    snprintf(text, sizeof text, "%s%s%s</mujoco>", head, body, c->rest);
    return kit_model(text);
}

/* The leg falls on the ground, bent and moving, with targets that change. */
static void start(const mjModel *m, mjData *d) {
    static const double bend[3] = {-0.4, 0.9, -0.5};
    memcpy(d->qpos + 7, bend, sizeof bend);
    d->qpos[2] = 0.6;
    d->qvel[0] = 0.3;
    d->qvel[4] = 0.5;
    for (int i = 0; i < m->nu; i++) {
        d->ctrl[i] = i < 3 ? bend[i] : 0;
    }
}

/* Largest difference between the twists that the ground expects and those of the step. */
static double surprise(const Case *c, double dt, const char *integrator, const char *ground,
                       int *loaded, int *rounds) {
    double worst = 0;
    mjModel *m = leg(c, dt, integrator, ground);
    mjData *d = mj_makeData(m);
    start(m, d);
    *loaded = *rounds = 0;
    for (int i = 0; i < (int)(0.6 / dt); i++) {
        double expected[6];
        mj_forward(m, d);
        const Soft *soft = plugin_soft(m, d);
        memcpy(expected, soft->contact.velocity, sizeof expected);
        mj_step(m, d);
        for (int r = 0; r < 6; r++) {
            worst = fmax(worst, fabs(expected[r] - soft->contact.velocity[r]));
        }
        *loaded += soft->contact.foot[0].contacts > 0;
        *rounds = soft->rounds > *rounds ? soft->rounds : *rounds;
    }
    mj_deleteData(d);
    mj_deleteModel(m);
    return worst;
}

/* Bool: Euler's method, which treats feedback explicitly, is stable. */
static int is_mild(const Case *c) {
    return !strstr(c->rest, "kv=") && !strstr(c->rest, "biasprm");
}

TEST(step_is_as_expected) {
    static const char *const integrators[] = {"Euler", "implicitfast", "implicit", "discrete"};
    for (int k = 0; k < 4; k++) {
        for (int c = 0; c < CASES; c++) {
            int loaded, rounds;
            if (k == 0 && !is_mild(&cases[c])) {
                continue;
            }
            const double worst =
                surprise(&cases[c], 0.004, integrators[k], "foam45", &loaded, &rounds);
            print_message("%-12s %-20s twist apart by %.1e, %d steps loaded, %d rounds\n",
                          integrators[k], cases[c].name, worst, loaded, rounds);
            assert_true(loaded > 20);
            assert_true(worst < 2e-6);
            assert_in_range(rounds, 0, 20);
            assert_int_equal(kit_messages, 0);
        }
    }
}

static const Case *find_case(const char *name) {
    int c = 0;
    while (strcmp(cases[c].name, name) != 0) {
        c++;
    }
    return &cases[c];
}

/* Joint limits that the ground's force closes and opens in turn: two sets of constraints, each of
 * which follows from the other. */
TEST(cycles_end) {
    static const struct {
        const char *name, *integrator, *ground;
        double dt;
    } hard[] = {{"armature", "Euler", "rubber", 0.001},
                {"tendon", "implicitfast", "foam45", 0.002},
                {"tendon", "discrete", "running_track", 0.001},
                {"activation", "implicitfast", "running_track", 0.004}};
    for (int n = 0; n < 4; n++) {
        int loaded, rounds;
        const double worst = surprise(find_case(hard[n].name), hard[n].dt, hard[n].integrator,
                                      hard[n].ground, &loaded, &rounds);
        print_message("%-20s %-12s %-10s %g ms: twist apart by %.1e, %d rounds\n", hard[n].name,
                      hard[n].integrator, hard[n].ground, 1e3 * hard[n].dt, worst, rounds);
        assert_true(worst < 2e-6);
        assert_in_range(rounds, 13, 29);
        assert_int_equal(kit_messages, 0);
    }
}

/* Cones of friction of other contacts are solved in turn with the ground. A constraint solver of
 * one iteration does not come to rest, and this is said once, and once more after a reset. */
TEST(disagreement_is_said) {
    const Case table = {"",
                        {"", "", ""},
                        "<worldbody><geom name='table' type='box' size='1 1 .1' pos='0 0 .42'/>"
                        "</worldbody><contact><pair geom1='trunk' geom2='table'/></contact>"};
    mjModel *m = leg(&table, 0.002, "Euler", "sand_loose");
    mjData *d = mj_makeData(m);
    m->opt.cone = mjCONE_ELLIPTIC;
    m->opt.solver = mjSOL_CG;
    m->opt.iterations = 1;
    for (int run = 1; run <= 2; run++) {
        int steps = 0;
        start(m, d);
        for (int i = 0; i < 300; i++) {
            mj_step(m, d);
            steps += plugin_soft(m, d)->rounds == 30;
        }
        print_message("%d of 300 steps without agreement: %s\n", steps, kit_said);
        assert_in_range(steps, 1, 299);
        assert_int_equal(kit_messages, run);
        assert_names(kit_said, "disagree pyramidal");
        mj_resetData(m, d);
    }
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* The plugin's sensor against MuJoCo's own generalised forces, and against the weight and the place
 * of what stands still. */

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
