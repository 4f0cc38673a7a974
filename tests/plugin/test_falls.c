/* Rigid bodies with one or two feet, or with shells that meet the ground on any side, fall on soft
 * ground in MuJoCo. The ground has stored nothing,
 * so that its work on the body is never above 0. Bodies are those of robots, or of 1 g to 100 t
 * with their mass anywhere; they turn, so that Coriolis forces are part of every step.
 * Arguments: number of falls of each kind (default 40), the first seed (default 1), the integrator
 * (default: each in turn) and the step [s] (default 0.005). docs/plugin.md says how many ran. */
#include <math.h>

#include "draws.h"
#include "materials.h"
#include "plugin_kit.h"

#define TURN_MOST 0.1 /* [rad] in a step; beyond it the way of a foot is not its twist */
#define STEPS 120
#define SETTLES 30 /* rounds: a step that ends with so many has not settled, as the plugin says */
#define AGREES 1.1e-6 /* [m/s, rad/s] within which the twists of the others are as expected */

static int falls = 40;
static uint64_t first = 1;
static const char *chosen; /* integrator; NULL: each in turn */
static double step = 0.005;
static int paper; /* bool: the paper's presets and pitch alone */

static const char *const integrators[] = {"implicitfast", "Euler", "implicit", "discrete"};

enum { ROBOT, ANY, SHELL, KINDS };

/* ---- drawing a body ---- */

static void add(char *text, size_t size, const char *format, ...) {
    va_list arguments;
    const size_t length = strlen(text);
    va_start(arguments, format);
    vsnprintf(text + length, size - length, format, arguments);
    va_end(arguments);
    assert_true(strlen(text) + 1 < size);
}

static void add_ground(uint64_t *random, char *text, size_t size) {
    const int count = paper ? PAPER_PRESETS : mild_material_preset_count();
    const char *preset = mild_material_preset_name(kit_index(random, count));
    const double recovery = kit_index(random, 3) ? kit_uniform(random, 0, 1) : kit_index(random, 2);
    add(text, size, "<config key='ground' value='%s'/>", preset);
    add(text, size, "<config key='ground.k_pen' value='%.17g'/>", kit_spread(random, 8, 1400));
    add(text, size, "<config key='ground.sigma_cone' value='%.17g'/>",
        kit_spread(random, 1e4, 2.4e5));
    add(text, size, "<config key='ground.alpha' value='%.17g'/>", kit_uniform(random, 0.698, 1.31));
    add(text, size, "<config key='ground.nu' value='%.17g'/>", kit_uniform(random, 0.8, 2.4));
    add(text, size, "<config key='ground.c_g' value='%.17g'/>", kit_uniform(random, -1.4, 4.6));
    add(text, size, "<config key='ground.c_d' value='%.17g'/>", kit_uniform(random, -6, 28));
    add(text, size, "<config key='ground.phi' value='%.17g'/>", kit_uniform(random, 0.5, 0.64));
    add(text, size, "<config key='ground.mu' value='%.17g'/>", kit_uniform(random, 0.2, 1.3));
    add(text, size, "<config key='ground.recovery' value='%.17g'/>", recovery);
    add(text, size, "<config key='ground.bed_depth' value='%.17g'/>",
        kit_uniform(random, 0.1, 0.15));
    add(text, size, "<config key='ground.passive' value='true'/>");
    add(text, size, paper ? CONFIG("pitch", "0.0195") : "");
}

/* The body's inertia: that of a box, of any proportions. */
static void add_inertia(uint64_t *random, int kind, char *text, size_t size) {
    const double mass = kind == ANY ? kit_spread(random, 1e-3, 1e5) : kit_spread(random, 0.3, 60);
    const double share = kind == ANY ? kit_spread(random, 1e-6, 1) : kit_spread(random, 4e-4, 0.04);
    const double x = kit_uniform(random, 0.05, 1), y = kit_uniform(random, 0.05, 1);
    const double z = kit_uniform(random, 0.05, 1);
    add(text, size, "<inertial pos='0 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/>", mass,
        mass * share * (y * y + z * z), mass * share * (x * x + z * z),
        mass * share * (x * x + y * y));
}

static void add_feet(uint64_t *random, int feet, char *text, size_t size) {
    const double x = kit_spread(random, 0.02, 0.3), y = kit_spread(random, 0.02, 0.15);
    const int central = !kit_index(random, 3);
    for (int f = 0; f < feet; f++) {
        const double levers[3] = {kit_uniform(random, -0.4, 0.4), kit_uniform(random, -0.4, 0.4),
                                  kit_uniform(random, -0.8, 0)};
        add(text, size, "<body name='foot%d' pos='%.17g %.17g %.17g'>", f, central ? 0 : levers[0],
            central ? 0 : levers[1], central ? 0 : levers[2]);
        add(text, size,
            "<geom type='box' size='%.17g %.17g .005' pos='0 0 .005' mass='0' contype='0' "
            "conaffinity='0'/></body>",
            x / 2, y / 2);
    }
}

/* Boxes, capsules and balls in any place and turned any way, with elements all over. */
static void add_shells(uint64_t *random, int shells, char *text, size_t size) {
    static const char *const types[] = {"box", "capsule", "sphere", "cylinder"};
    for (int b = 0; b < shells; b++) {
        add(text, size, "<body name='foot%d' pos='%.17g %.17g %.17g'>", b,
            kit_uniform(random, -0.3, 0.3), kit_uniform(random, -0.3, 0.3),
            kit_uniform(random, -0.3, 0.3));
        add(text, size,
            "<geom type='%s' size='%.17g %.17g %.17g' euler='%.17g %.17g 0' mass='0' "
            "contype='0' conaffinity='0'/></body>",
            types[kit_index(random, 4)], kit_spread(random, 0.02, 0.15),
            kit_spread(random, 0.02, 0.15), kit_spread(random, 0.02, 0.15),
            kit_uniform(random, -180, 180), kit_uniform(random, -90, 90));
    }
}

/* The body, with the plugin and without it. */
static void draw_models(uint64_t *random, int kind, const char *integrator, mjModel **soft,
                        mjModel **bare) {
    static char text[6000], body[2000], option[200];
    const int feet = kind == SHELL ? 1 + kit_index(random, 4) : 1 + kit_index(random, 2);
    body[0] = '\0';
    snprintf(option, sizeof option, "<mujoco><option timestep='%.17g' integrator='%s'/>", step,
             integrator);
    text[0] = '\0';
    add(text, sizeof text,
        "%s<extension><plugin plugin='mild.ground'><instance name='soft'><config key='%s' "
        "value='foot0%s%s%s'/>",
        option, kind == SHELL ? "body" : "feet", feet > 1 ? " foot1" : "", feet > 2 ? " foot2" : "",
        feet > 3 ? " foot3" : "");
    add_ground(random, text, sizeof text);
    add(body, sizeof body, "<worldbody><body name='body'><freejoint/>");
    add_inertia(random, kind, body, sizeof body);
    if (kind == SHELL) {
        add_shells(random, feet, body, sizeof body);
    } else {
        add_feet(random, feet, body, sizeof body);
    }
    add(body, sizeof body, "</body></worldbody></mujoco>");
    add(text, sizeof text, "</instance></plugin></extension>%s", body);
    *soft = kit_model(text);
    snprintf(text, sizeof text, "%s%s", option, body);
    *bare = kit_model(text);
}

/* [m] Lowest corner of the feet, or of balls about the shells. */
static double lowest(const mjModel *m, const mjData *d) {
    double low = INFINITY;
    for (int g = 0; g < m->ngeom; g++) {
        if (plugin_soft(m, d)->foot[0].shell) {
            low = fmin(low, d->geom_xpos[3 * g + 2] - m->geom_rbound[g]);
            continue;
        }
        for (int c = 0; c < 4; c++) {
            const double *half = m->geom_size + 3 * g, *turn = d->geom_xmat + 9 * g;
            const double x = c & 1 ? half[0] : -half[0], y = c & 2 ? half[1] : -half[1];
            low =
                fmin(low, d->geom_xpos[3 * g + 2] + turn[6] * x + turn[7] * y - turn[8] * half[2]);
        }
    }
    return low;
}

/* Steep, fast, or both; above the ground. */
static void draw_motion(uint64_t *random, const mjModel *m, mjData *d) {
    for (int k = 0; k < 6; k++) {
        d->qvel[k] = k < 2   ? kit_uniform(random, -2, 2)
                     : k < 3 ? kit_uniform(random, -3, 0)
                             : kit_uniform(random, -1, 1);
    }
    if (!kit_index(random, 5)) {
        double turn[3];
        for (int k = 0; k < 3; k++) {
            turn[k] = kit_uniform(random, -3, 3);
        }
        mju_quatIntegrate(d->qpos + 3, turn, 1);
    }
    if (!kit_index(random, 8)) {
        d->qvel[0] *= 50;
        d->qvel[2] *= 7;
    }
    d->qpos[2] = 0;
    mj_kinematics(m, d);
    d->qpos[2] = kit_spread(random, 1e-4, 0.5) - lowest(m, d);
}

/* ---- falling ---- */

typedef struct {
    double turn;     /* [rad] most in a step */
    double gain;     /* [-] most energy from the ground so far, as a share of the most kinetic */
    double surprise; /* [m/s, rad/s] most between the twists that the ground expects and gets */
    double open;     /* [m/s, rad/s] the same in steps that have not settled */
    int opens;       /* steps that have not settled */
    int loaded;      /* steps */
} Fall;

/* [J] The centre of mass is the origin of the body's frame. */
static double kinetic(const mjModel *m, const mjData *d) {
    const int body = m->jnt_bodyid[0];
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        sum += m->body_mass[body] * d->qvel[k] * d->qvel[k];
        sum += m->body_inertia[3 * body + k] * d->qvel[3 + k] * d->qvel[3 + k];
    }
    return sum / 2;
}

/* [J] Work of the ground in a step from the state of `before`: at the mean of the twists of the
 * feet after the step and after one without ground, which `before` then has done. */
static double ground_work(const mjModel *bare, mjData *before, const Soft *soft) {
    const int nv = (int)bare->nv;
    double work = 0;
    mj_step(bare, before);
    for (int r = 0; r < soft->near_rows; r++) {
        const int f = soft->near[r / 6], k = r % 6;
        const MildFootResult *foot = &soft->contact.foot[f];
        const double free = mju_dot(soft->jacobian + r * nv, before->qvel, nv);
        work += (k < 3 ? foot->force[k] : foot->torque[k - 3]) *
                (soft->contact.velocity[6 * f + k] + free) / 2;
    }
    return bare->opt.timestep * work;
}

/* Counts the energy from the ground in two ways: as its work, and as what the body has after a step
 * beyond what it has after one without ground. */
static Fall fall(const mjModel *m, mjData *d, const mjModel *bare) {
    Fall result = {0};
    double most = kinetic(m, d), work = 0, given = 0;
    mjData *before = mj_makeData(bare);
    for (int s = 0; s < STEPS; s++) {
        double expected[FOOT_ROWS];
        mju_copy(before->qpos, d->qpos, (int)m->nq);
        mju_copy(before->qvel, d->qvel, (int)m->nv);
        mj_forward(m, d);
        const Soft *soft = plugin_soft(m, d);
        memcpy(expected, soft->contact.velocity, sizeof expected);
        mj_step(m, d);
        int loaded = 0;
        for (int f = 0; f < soft->feet; f++) {
            loaded |= soft->contact.foot[f].contacts > 0;
        }
        const int settled = soft->rounds < SETTLES;
        double *surprise = settled ? &result.surprise : &result.open;
        for (int r = 0; r < 6 * soft->feet && loaded; r++) {
            *surprise = fmax(*surprise, fabs(expected[r] - soft->contact.velocity[r]));
        }
        result.opens += !settled;
        result.loaded += loaded;
        result.turn = fmax(result.turn, m->opt.timestep * mju_norm3(d->qvel + 3));
        most = fmax(most, kinetic(m, d));
        work += ground_work(bare, before, soft);
        given += kinetic(m, d) - kinetic(bare, before);
        result.gain = fmax(result.gain, fmax(work, given) / most);
    }
    mj_deleteData(before);
    return result;
}

typedef struct {
    int falls, loaded;     /* loaded: falls with a step in the ground */
    int gained;            /* falls that gain more than 1e-9 */
    double worst;          /* [-] of falls that turn by less than TURN_MOST in a step */
    uint64_t seed;         /* of the worst */
    int spun, spun_gained; /* falls that turn by more */
    double spun_worst;     /* [-] */
    double surprise, open; /* [m/s, rad/s] of the others */
    int opens, steps;      /* steps of the others: not settled, loaded */
} Falls;

static void fall_once(uint64_t seed, int kind, const char *integrator, Falls *all) {
    uint64_t random = seed * 1000003u + 7919u;
    mjModel *m, *bare;
    draw_models(&random, kind, integrator, &m, &bare);
    mjData *d = mj_makeData(m);
    draw_motion(&random, m, d);
    const Fall one = fall(m, d, bare);
    all->falls++;
    all->loaded += one.loaded > 0;
    if (one.turn > TURN_MOST) {
        all->spun++;
        all->spun_gained += one.gain > 1e-9;
        all->spun_worst = fmax(all->spun_worst, one.gain);
    } else {
        all->gained += one.gain > 1e-9;
        all->surprise = fmax(all->surprise, one.surprise);
        all->open = fmax(all->open, one.open);
        all->opens += one.opens;
        all->steps += one.loaded;
        assert_int_equal(kit_messages, one.opens > 0); /* said, and said once */
        if (one.gain > all->worst) {
            all->worst = one.gain;
            all->seed = seed;
        }
    }
    mj_deleteData(d);
    mj_deleteModel(m);
    mj_deleteModel(bare);
}

TEST(the_ground_never_gives_energy) {
    static const char *const names[KINDS] = {"robots", "anything", "shells"};
    paper = 0;
    for (int n = 0; n < 4 * KINDS; n++) {
        const char *integrator = integrators[n % 4];
        if (chosen && strcmp(chosen, integrator) != 0) {
            continue;
        }
        Falls all = {0};
        for (int i = 0; i < falls; i++) {
            fall_once(first + (uint64_t)i, n / 4, integrator, &all);
        }
        print_message(
            "%-12s %-8s: %d falls, %d loaded; %d gain, at most %.1e (seed %llu), twists "
            "apart by %.1e, in %d of %d steps by %.1e; %d turn by over %.1f rad in a step, %d of "
            "them gain, at most %.2g\n",
            integrator, names[n / 4], all.falls, all.loaded, all.gained, all.worst,
            (unsigned long long)all.seed, all.surprise, all.opens, all.steps, all.open, all.spun,
            TURN_MOST, all.spun_gained, all.spun_worst);
        assert_int_equal(all.falls, all.loaded);
        assert_true(all.worst < 1e-9);
        assert_true(all.surprise < AGREES);
        assert_true(all.opens <= 1 + all.steps / 1000 && all.open < 1e-3);
    }
}

/* The only fall of 4800 that turns little and gains: a light body that bounces within one step, as
 * those of tests/ground/test_falls.c. With a tenth of the step it gains nothing. */
TEST(a_bounce_within_a_step_gains_little) {
    Falls all = {0};
    paper = 1;
    fall_once(100323, ANY, "implicitfast", &all);
    print_message("light body: gains %.1e, twists apart by %.1e\n", all.worst, all.surprise);
    assert_int_equal(all.spun, 0);
    assert_true(all.worst > 0.03 && all.worst < 0.05); /* 3.7 % */
    assert_true(all.surprise < AGREES);
    assert_int_equal(all.opens, 0);
}

int main(int argc, char **argv) {
    falls = argc > 1 ? atoi(argv[1]) : kit_short() ? 1 + falls / 5 : falls;
    first = argc > 2 ? strtoull(argv[2], NULL, 10) : first;
    chosen = argc > 3 ? argv[3] : NULL;
    step = argc > 4 ? atof(argv[4]) : step;
    return run_cases(kit_setup, NULL);
}
