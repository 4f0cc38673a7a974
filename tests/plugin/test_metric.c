/* The inertia that the ground counts with is the integrator's: the twists of the feet that the
 * ground expects at the end of a step are those that MuJoCo gives, for every kind of force that an
 * integrator treats implicitly. With another inertia robots with strong feedback become
 * unstable. */
#include <math.h>

#include "plugin_kit.h"

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

TEST_MAIN(kit_setup, NULL)
