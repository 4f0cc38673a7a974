/* A robot that stands on its joint limits: a stool whose legs gravity spreads until their limits
 * hold them, against the static sinkage of a foot, and one whose motors press its legs against
 * their limits, which must not move it. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "robot_kit.h"

enum { LEGS = 4 };

/* ---- a stool ---- */

/* Hinge axis of the left legs and of the right ones, sideways and downward to the foot. */
static const char frame[] =
    "<mujoco><compiler angle='radian' autolimits='true'/>\n"
    "<default><joint actuatorfrcrange='-100 100' range='-0.5 0.02' armature='0.01'/></default>\n"
    "<worldbody><body name='seat' pos='0 0 1'><freejoint/>\n"
    "<geom name='plank' type='box' size='0.3 0.2 0.03' mass='30'/>\n"
    "%s</body></worldbody></mujoco>\n";
static const char leg[] = "<body name='%s_upper' pos='%s 0'><joint name='%s' axis='%s'/>"
                          "<geom type='capsule' fromto='0 0 0 0 %s %s' size='0.02' mass='1'/>"
                          "<body name='%s_foot' pos='0 %s %s'>"
                          "<geom type='sphere' size='0.04' mass='0.2'/></body></body>\n";

#define FOOT(name, mirror, offset)                                                                 \
    "[foot." name "]\nbody = " name "_foot\nknee = " name "_upper\nmirror = " mirror               \
    "\noffset = " offset "\nshape = round\ncenter = 0 0 0\nradius = 0.04\npitch = 0.01\n"

static const char ini[] =
    "[robot]\nname = stool\nmodel = stool.xml\nbase = seat\nshells = plank\nheight = 0.44\n"
    "action_scale = 0.3\nfeet_range = 0.1 0.9\nknee_range = 0.1 0.9\nfeet_least = 0.07\n"
    "knee_least = 0.08\nfoot_force = 300\nassist = 100 10 50 20\n"
    "[joints]\nnames = fl fr rl rr\nmirror = fr fl rr rl\nmirror_sign = 1 1 1 1\npose = 0 0 0 0\n"
    "kp = 1 1 1 1\nkd = 1 1 1 1\neffort = 0 0 0 0\nspeed = 1 1 1 1\nswing = 0 0 0 0\n"
    "still = 0 0 0 0\n" FOOT("fl", "fr", "0") FOOT("fr", "fl", "0.5") FOOT("rl", "rr", "0.5")
        FOOT("rr", "rl", "0");

/* left, right: axes of the hinges; out, down: [m] from a hinge to its foot. */
static Robot *make_stool(const char *left, const char *right, const char *out, const char *down) {
    static const char *const name[LEGS] = {"fl", "fr", "rl", "rr"};
    static const char *const place[LEGS] = {"0.25 0.1", "0.25 -0.1", "-0.25 0.1", "-0.25 -0.1"};
    char legs[2000] = "", mjcf[3000], side[16];
    MildError error = {0};
    for (int f = 0; f < LEGS; f++) {
        const size_t length = strlen(legs);
        snprintf(side, sizeof side, "%s%s", f % 2 ? "-" : "", out);
        snprintf(legs + length, sizeof legs - length, leg, name[f], place[f], name[f],
                 f % 2 ? right : left, side, down, name[f], side, down);
    }
    snprintf(mjcf, sizeof mjcf, frame, legs);
    Robot *stool = kit_robot_of("stool.xml", mjcf, ini, &error);
    expect_good(stool != NULL, &error);
    return stool;
}

typedef struct {
    RobotSim *sim;
    MildGround *ground;
} Place;

/* A preset for feet as small as the stool: 3.8 times as stiff, with cones half as wide. */
static MildMaterial firm(const char *name) {
    MildMaterial m = kit_preset(name);
    const double r = 0.0195 / 0.01;
    m.k_pen *= r * r;
    m.k_drift *= r * r;
    m.b_drift *= r * r;
    m.nu *= r;
    m.c_g /= r;
    return m;
}

static MildTerrain firm_terrain(const char *name) {
    MildTerrain terrain = kit_terrain(name);
    terrain.materials[0] = firm(name);
    return terrain;
}

static Place stand_on(const Robot *stool, double dt) {
    MildError error = {0};
    Place on = {robot_sim_create(stool, dt, &error), NULL};
    assert_non_null(on.sim);
    on.ground = kit_ground(stool);
    return on;
}

static void step_off(Place *on) {
    free(on->ground);
    robot_sim_destroy(on->sim);
}

static const char *const material_name[] = {"rubber", "foam45", "sand_loose"};
static const double time_step[] = {0.001, 0.002, 0.005};
enum { MATERIALS = 3, STEPS = 3 };

/* ---- a load on the limits ---- */

/* [m] Mean depth of the feet of a stool without motors after three seconds. */
static double stool_depth(const Robot *stool, const char *material, double dt) {
    const MildTerrain terrain = firm_terrain(material);
    const double torque[LEGS] = {0};
    Place on = stand_on(stool, dt);
    double depth = 0;
    for (int i = 0; i < (int)(3 / dt); i++) {
        assert_int_equal(robot_sim_step(on.sim, torque, NULL, &terrain, on.ground), 0);
    }
    for (int f = 0; f < LEGS; f++) {
        assert_true(robot_sim_qpos(on.sim)[7 + f] > 0.0201); /* beyond its limit */
        depth += robot_sim_foot(on.sim, f)->result.depth_mean / LEGS;
    }
    step_off(&on);
    return depth;
}

/* Gravity spreads the legs until their limits hold them, because the feet slip. How deep they are
 * then does not depend on the time step. On rubber, which slipping digs into the least, it is what
 * the weight alone makes. */
TEST(test_load) {
    Robot *stool = make_stool("1 0 0", "-1 0 0", "0.4", "-0.2");
    const MildMaterial rubber = firm("rubber");
    const double wanted = mild_sole_sinkage(robot_soles(stool)[0], &rubber, robot_foot_load(stool));
    for (int m = 0; m < MATERIALS; m++) {
        double depth[STEPS];
        for (int s = 0; s < STEPS; s++) {
            depth[s] = stool_depth(stool, material_name[m], time_step[s]);
            expect_entry(material_name[m], s, depth[s], depth[0], 0.02 * depth[0]);
        }
        assert_true(m > 0 || fabs(depth[0] - wanted) < 0.05 * wanted);
    }
    robot_destroy(stool);
}

/* ---- motors against the limits ---- */

/* [m] How far the stool moves in the last two of four seconds. */
static double pressed(const Robot *stool, const char *material, double dt) {
    const MildTerrain terrain = firm_terrain(material);
    double torque[LEGS], at[2] = {0, 0};
    Place on = stand_on(stool, dt);
    for (int j = 0; j < LEGS; j++) {
        torque[j] = robot_effort(stool)[j];
    }
    for (int i = 0; i < (int)(4 / dt); i++) {
        assert_int_equal(robot_sim_step(on.sim, torque, NULL, &terrain, on.ground), 0);
        if (i == (int)(2 / dt)) {
            memcpy(at, robot_sim_qpos(on.sim), sizeof at);
        }
    }
    const double *now = robot_sim_qpos(on.sim);
    const double moved = hypot(now[0] - at[0], now[1] - at[1]);
    assert_true(robot_sim_base_rotation(on.sim)[8] > 0.95);
    step_off(&on);
    return moved;
}

/* Its motors press all legs backward against their limits. They do no work then, so the friction
 * under the feet may not move it. */
TEST(test_pressed) {
    Robot *stool = make_stool("0 1 0", "0 1 0", "0.1", "-0.4");
    for (int m = 0; m < MATERIALS; m++) {
        for (int s = 0; s < STEPS; s++) {
            expect_entry(material_name[m], s, pressed(stool, material_name[m], time_step[s]), 0,
                         0.01);
        }
    }
    robot_destroy(stool);
}

TEST_MAIN(setup, teardown)
