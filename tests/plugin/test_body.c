/* Bodies with elements all over: a robot that falls lies on its shells. While they are in the air
 * they change nothing. */
#include <math.h>

#include "plugin/plugin.h"
#include "plugin_kit.h"

#define OFF "contype='0' conaffinity='0'"
#define SENSOR "<sensor><plugin name='felt' plugin='mild.ground' instance='soft'/></sensor>"

/* A quadruped: a box with four legs of a capsule, a box and a round foot. */
#define LEG(name, x, y)                                                                            \
    "<body name='" name "_thigh' pos='" x " " y " 0'><joint name='" name "_hip' axis='0 1 0' "     \
    "range='-60 60' damping='.5'/><geom type='capsule' fromto='0 0 0 0 0 -.2' size='.03' "         \
    "mass='.8' " OFF "/><body name='" name "_shin' pos='0 0 -.2'><joint name='" name "_knee' "     \
    "axis='0 1 0' range='-100 10' damping='.5'/><geom type='box' size='.02 .02 .07' pos='0 0 "     \
    "-.07' mass='.3' " OFF "/><body name='" name "_foot' pos='0 0 -.21'><geom size='.03' "         \
    "mass='.06' " OFF "/></body></body></body>"
#define QUADRUPED                                                                                  \
    "<worldbody><body name='base' pos='0 0 .45'><freejoint/><geom type='box' size='.2 .1 .05' "    \
    "mass='6' " OFF "/>" LEG("fl", ".18", ".12") LEG("fr", ".18", "-.12") LEG("rl", "-.18", ".12") \
        LEG("rr", "-.18", "-.12") "</body></worldbody>"
#define SERVO(name)                                                                                \
    "<position joint='" name "_hip' kp='80' kv='2'/><position joint='" name "_knee' kp='80' "      \
    "kv='2'/>"
#define SERVOS "<actuator>" SERVO("fl") SERVO("fr") SERVO("rl") SERVO("rr") "</actuator>"
#define FEET "fl_foot fr_foot rl_foot rr_foot"
#define BODIES "base fl_thigh fl_shin fr_thigh fr_shin rl_thigh rl_shin rr_thigh rr_shin"
enum { BOTH = 13 }; /* feet and bodies */

/* A humanoid of boxes, capsules, a cylinder and a ball, whose joints only have friction. */
#define LIMB(name, kind, at, joint, size, length, mass)                                            \
    "<body name='" name "_" kind "' pos='" at "'><joint axis='0 1 0' damping='2' "                 \
    "frictionloss='3'/><geom type='" joint "' size='" size "' pos='0 0 -" length "' mass='" mass   \
    "' " OFF "/>"
#define SIDE(name, y)                                                                              \
    LIMB(name, "thigh", "0 " y " -.1", "capsule", ".06 .14", ".17", "5")                           \
    LIMB(name, "shin", "0 0 -.38", "box", ".05 .045 .18", ".17", "3")                              \
    LIMB(name, "foot", "0 0 -.38", "box", ".11 .05 .02", ".03", "1")                               \
    "</body></body></body>"
#define ARM(name, y)                                                                               \
    LIMB(name, "arm", "0 " y " .4", "capsule", ".04 .1", ".13", "2")                               \
    LIMB(name, "hand", "0 0 -.28", "cylinder", ".035 .12", ".12", "1") "</body></body>"
#define HUMANOID                                                                                   \
    "<worldbody><body name='pelvis' pos='0 0 .9'><freejoint/><geom type='box' size='.06 .14 .08' " \
    "mass='8' " OFF "/><body name='torso' pos='0 0 .08'><joint axis='0 1 0' damping='4' "          \
    "frictionloss='5'/><geom type='box' size='.08 .15 .2' pos='0 0 .2' mass='14' " OFF "/>"        \
    "<body name='head' pos='0 0 .5'><joint axis='0 1 0' damping='1' frictionloss='1'/><geom "      \
    "size='.09' mass='3' " OFF "/></body>" ARM("l", ".21")                                         \
        ARM("r", "-.21") "</body>" SIDE("l", ".09") SIDE("r", "-.09") "</body></worldbody>"
#define SHELLS "pelvis torso head l_arm l_hand r_arm r_hand l_thigh l_shin r_thigh r_shin"
#define MASS (8 + 14 + 3 + 2 * (2 + 1) + 2 * (5 + 3 + 1))
#define GRAVITY 9.81

static mjModel *make(double dt, const char *integrator, const char *feet, const char *ground,
                     const char *keys, const char *rest) {
    static char head[2000], text[12000];
    kit_head(head, sizeof head, dt, integrator, feet, ground, keys);
    snprintf(text, sizeof text, "%s%s%s</mujoco>", head, rest, SENSOR);
    return kit_model(text);
}

static mjModel *quadruped(const char *integrator, const char *keys) {
    return make(0.002, integrator, FEET, "foam45", keys, QUADRUPED SERVOS);
}

static mjModel *humanoid(double dt, const char *integrator, const char *ground) {
    return make(dt, integrator, "l_foot r_foot", ground, CONFIG("body", SHELLS), HUMANOID);
}

/* Above the ground, turned about x (on its side) or y (on its back). */
static void lay(mjData *d, int axis, double angle, double height) {
    d->qpos[2] = height;
    d->qpos[3] = cos(angle / 2);
    d->qpos[4 + axis] = sin(angle / 2);
}

static const mjtNum *felt(const mjModel *m, const mjData *d, int foot) {
    return d->sensordata + m->sensor_adr[0] + (ptrdiff_t)(SENSOR_NUMBERS * foot);
}

/* ---- in the air ---- */

TEST(in_the_air_they_change_no_bit) {
    static const char *const integrators[] = {"Euler", "implicitfast", "implicit", "discrete"};
    for (int k = 0; k < 4; k++) {
        mjModel *bare = quadruped(integrators[k], CONFIG("prints", "64"));
        mjModel *full = quadruped(integrators[k], CONFIG("prints", "64") CONFIG("body", BODIES));
        mjData *d = mj_makeData(bare), *e = mj_makeData(full);
        int loaded = 0;
        assert_int_equal(full->sensor_dim[0], BOTH * SENSOR_NUMBERS);
        for (int i = 0; i < 300; i++) {
            d->ctrl[1] = e->ctrl[1] = -0.3 * (i > 150);
            mj_step(bare, d);
            mj_step(full, e);
            const Soft *soft = plugin_soft(full, e);
            assert_int_equal(soft->near_rows, 24);
            loaded += soft->contact.foot[0].contacts > 0;
            assert_memory_equal(d->qpos, e->qpos, (size_t)full->nq * sizeof(mjtNum));
            assert_memory_equal(d->qvel, e->qvel, (size_t)full->nv * sizeof(mjtNum));
            assert_memory_equal(d->sensordata, e->sensordata, 4 * SENSOR_NUMBERS * sizeof(mjtNum));
            for (int n = 4 * SENSOR_NUMBERS; n < BOTH * SENSOR_NUMBERS; n++) {
                assert_true(e->sensordata[n] == 0);
            }
        }
        assert_true(loaded > 200);
        mj_deleteData(d);
        mj_deleteData(e);
        mj_deleteModel(bare);
        mj_deleteModel(full);
    }
}

/* ---- on the ground ---- */

/* [J] Of the ground in the last step: its impulse at the mean of the twists with and without it. */
static double ground_work(const Soft *soft) {
    double power = 0;
    for (int r = 0; r < soft->near_rows; r++) {
        const int f = soft->near[r / 6], k = r % 6;
        const MildFootResult *foot = &soft->contact.foot[f];
        power += (k < 3 ? foot->force[k] : foot->torque[k - 3]) *
                 (soft->contact.velocity[6 * f + k] + soft->free[r]) / 2;
    }
    return soft->input.dt * power;
}

/* Drops the humanoid, lets it come to rest, and holds what it feels. */
static void lie_down(int axis, double angle, const char *ground, const char *integrator) {
    mjModel *m = humanoid(0.005, integrator, ground);
    mjData *d = mj_makeData(m);
    double force[3] = {0, 0, 0}, shells = 0, fastest = 0, work = 0, given = 0;
    int most = 0, unsolved = 0, bodies = 0, rounds = 0;
    lay(d, axis, angle, 0.35);
    for (int i = 0; i < 1600; i++) {
        int loaded = 0;
        mj_step(m, d);
        const Soft *soft = plugin_soft(m, d);
        for (int f = 0; f < BOTH; f++) {
            loaded += soft->contact.foot[f].contacts > 0;
        }
        most = loaded > most ? loaded : most;
        unsolved += !soft->contact.converged;
        work += ground_work(soft);
        given = fmax(given, work);
        rounds = soft->rounds > rounds ? soft->rounds : rounds;
    }
    for (int f = 0; f < BOTH; f++) {
        mju_addTo3(force, felt(m, d, f));
        shells += f < 2 ? 0 : felt(m, d, f)[2];
        bodies += f >= 2 && felt(m, d, f)[2] > 0;
    }
    for (int i = 0; i < m->nv; i++) {
        fastest = fmax(fastest, fabs(d->qvel[i]));
    }
    print_message(
        "%-10s %-12s %s: %.3f N of %.3f, %.1f %% on %d bodies, %d of 13 touch at most, "
        "%d steps unsolved, %d rounds, %.1e m/s left, %.1e N aside, the ground gave %.1e J and "
        "took %.0f\n",
        ground, integrator, axis ? "back" : "side", force[2], MASS * GRAVITY,
        100 * shells / force[2], bodies, most, unsolved, rounds, fastest, hypot(force[0], force[1]),
        given, -work);
    assert_true(given < 1e-9 && work < -0.1 * MASS * GRAVITY * 0.2);
    assert_true(fabs(force[2] - MASS * GRAVITY) < 0.01 * MASS * GRAVITY);
    assert_true(hypot(force[0], force[1]) < 0.01 * MASS * GRAVITY);
    assert_true(fastest < 0.03); /* heels creep: sand at its yield load holds nothing along */
    assert_true(shells > 0.8 * force[2]);
    assert_int_equal(unsolved, 0);
    assert_int_equal(kit_messages, 0);
    assert_in_range(most, axis ? 9 : 5, BOTH);
    assert_in_range(bodies, axis ? 7 : 4, BOTH);
    mj_deleteData(d);
    mj_deleteModel(m);
}

TEST(it_comes_to_rest_on_its_shells) {
    static const char *const grounds[] = {"foam45", "sand_loose"};
    static const char *const integrators[] = {"implicitfast", "discrete", "Euler"};
    for (int n = 0; n < 6; n++) {
        if (kit_short() && n != 0 && n != 3) {
            continue; /* each ground and two integrators */
        }
        lie_down(1, -mjPI / 2, grounds[n % 2], integrators[n / 2]);
        lie_down(0, mjPI / 2, grounds[n % 2], integrators[n / 2]);
    }
}

/* A plate that is a foot sinks as deep as one that is a body, however far apart its elements are,
 * where cones do not merge. */
TEST(a_body_sinks_as_a_foot_does) {
    static const char *const grounds[] = {"rubber", "foam45", "grass", "clay"};
    static const char *const keys[] = {"", CONFIG("body_pitch", "0.012")};
    for (int n = 0; n < 8; n++) {
        char head[1500], text[3000];
        kit_head(head, sizeof head, 0.002, "implicitfast", "foot", grounds[n / 2],
                 CONFIG("body", "body"));
        char *at = strstr(head, "<config key='body'");
        char more[1500];
        snprintf(more, sizeof more, "%s%s", keys[n % 2], at);
        snprintf(at, sizeof head - (size_t)(at - head), "%s", more);
        snprintf(text, sizeof text,
                 "%s<worldbody><body name='foot' pos='0 0 .025'><freejoint/><geom type='box' "
                 "size='.117 .078 .02' mass='9' " OFF "/></body><body name='body' pos='0 1 .025'>"
                 "<freejoint/><geom type='box' size='.117 .078 .02' mass='9' " OFF
                 "/></body></worldbody></mujoco>",
                 head);
        mjModel *m = kit_model(text);
        mjData *d = mj_makeData(m);
        kit_run(m, d, 3);
        const double foot = 0.02 - d->qpos[2], body = 0.02 - d->qpos[9];
        print_message("%-10s foot %.4f mm deep, body %.4f\n", grounds[n / 2], 1e3 * foot,
                      1e3 * body);
        assert_true(foot > 1e-4 && fabs(body - foot) < 2e-3 * foot);
        mj_deleteData(d);
        mj_deleteModel(m);
    }
}

/* A wheel rolls, and drives itself. */
TEST(a_wheel_rolls) {
    mjModel *m = kit_model(
        "<mujoco><option timestep='.002'/><extension><plugin plugin='mild.ground'><instance "
        "name='soft'>" CONFIG("body", "wheel") CONFIG("ground", "rubber")
            CONFIG("body_pitch",
                   "0.01") "</instance></plugin></extension><worldbody><body "
                           "pos='0 0 .11'><joint type='slide' axis='1 0 0'/>"
                           "<joint type='slide' axis='0 0 1'/>"
                           "<geom size='.03' mass='4' " OFF
                           "/><body name='wheel'><joint name='axle' axis='0 1 0'/>"
                           "<geom type='cylinder' euler='90 0 0' size='.1 .03' mass='1' " OFF
                           "/></body></body></worldbody><actuator><velocity joint='axle' kv='2' "
                           "ctrlrange='-9 9'/></actuator></mujoco>");
    mjData *d = mj_makeData(m);
    d->ctrl[0] = 5;
    kit_run(m, d, 1);
    const double from = d->qpos[0];
    kit_run(m, d, 2);
    const double way = (d->qpos[0] - from) / 2, rim = 0.1 * d->qvel[2];
    print_message("wheel rolls at %.3f m/s, its rim at %.3f\n", way, rim);
    assert_true(way > 0.4 && fabs(way - rim) < 0.05 * rim);
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* ---- shapes ---- */

/* A model of one body of this geom, or NULL. */
static mjModel *body_of(const char *geom, const char *keys, const char *asset) {
    static char text[9000];
    snprintf(text, sizeof text,
             "<mujoco><extension><plugin plugin='mild.ground'><instance name='soft'>" CONFIG(
                 "body", "body") "%s</instance></plugin></extension><asset>%s</asset><worldbody>"
                                 "<geom name='floor' type='plane' size='1 1 1'/><body name='body' "
                                 "pos='0 0 .4'><freejoint/>%s</body></worldbody></mujoco>",
             keys, asset, geom);
    kit_said[0] = '\0';
    kit_messages = 0;
    return kit_compile(text);
}

/* [m^2] of the surface; and that it is closed: no area is left over in any direction. */
static double surface_of(const char *geom, const char *keys, const char *asset) {
    mjModel *m = body_of(geom, keys, asset);
    if (!m) {
        fail_msg("%s", kit_said);
    }
    mjData *d = mj_makeData(m);
    const MildSole *sole = plugin_soft(m, d)->soles[0];
    double area = 0, left[3] = {0, 0, 0}, out = 0;
    for (int e = 0; e < mild_sole_elements(sole); e++) {
        const double a = mild_sole_surface_area(sole)[e];
        const double at[3] = {mild_sole_x(sole)[e], mild_sole_y(sole)[e],
                              mild_sole_surface_z(sole)[e]};
        area += a;
        for (int k = 0; k < 3; k++) {
            left[k] += a * mild_sole_surface_normal(sole, k)[e];
            out += a * mild_sole_surface_normal(sole, k)[e] * at[k];
        }
    }
    print_message("%-60.60s %4d elements, %.5f m^2\n", geom, mild_sole_elements(sole), area);
    assert_true(mju_norm3(left) < 0.02 * area);
    assert_true(out > 0); /* three times the volume: normals face outward */
    mj_deleteData(d);
    mj_deleteModel(m);
    return area;
}

#define VERTICES                                                                                   \
    "-.1 -.06 -.02 .1 -.06 -.02 -.1 .06 -.02 .1 .06 -.02 -.1 -.06 .02 .1 -.06 .02 -.1 .06 .02 "    \
    ".1 .06 .02"

TEST(shapes_are_covered) {
    const double box = 8 * (.1 * .06 + .06 * .02 + .1 * .02), r = .04, h = .1;
    const double cylinder = 2 * mjPI * r * (r + 2 * h), capsule = 4 * mjPI * r * (r + h);
    assert_true(fabs(surface_of("<geom type='box' size='.1 .06 .02'/>", "", "") / box - 1) < 1e-9);
    assert_true(fabs(surface_of("<geom type='capsule' size='.04 .1'/>", "", "") / capsule - 1) <
                1e-9);
    assert_true(fabs(surface_of("<geom size='.1'/>", "", "") / (.04 * mjPI) - 1) < 1e-9);
    assert_true(fabs(surface_of("<geom type='cylinder' size='.04 .1'/>", "", "") / cylinder - 1) <
                0.02);
    assert_true(fabs(surface_of("<geom type='ellipsoid' size='.1 .1 .1'/>", "", "") / (.04 * mjPI) -
                     1) < 0.02);
    for (int k = 0; k < 2; k++) { /* with MuJoCo's hull, and where it has none */
        const char *const geoms[] = {"<geom type='mesh' mesh='box'/>",
                                     "<geom type='mesh' mesh='box' " OFF "/>"};
        assert_true(
            fabs(surface_of(geoms[k], "", "<mesh name='box' vertex='" VERTICES "'/>") / box - 1) <
            1e-6);
    }
    /* turned, shifted, and with a picture of it that is no part of it */
    assert_true(
        fabs(surface_of("<geom type='box' size='.1 .06 .02' pos='.2 .1 0' euler='10 20 30'/>"
                        "<geom type='mesh' mesh='box' " OFF "/>",
                        "", "<mesh name='box' vertex='" VERTICES "'/>") /
                 box -
             1) < 1e-9);
}

/* ---- what a user may get wrong ---- */

static void check_bad_body(const char *keys, const char *geom, const char *asset,
                           const char *names) {
    static char text[4000];
    snprintf(text, sizeof text,
             "<mujoco><extension><plugin plugin='mild.ground'><instance name='soft'>%s</instance>"
             "</plugin></extension><asset>%s</asset><worldbody><body name='pole'><geom "
             "size='.1'/></body><body name='foot'><freejoint/><geom type='box' size='.1 .1 .1' " OFF
             "/><body name='shin' pos='0 0 1'>%s</body></body></worldbody></mujoco>",
             keys, asset, geom);
    kit_said[0] = '\0';
    mjModel *m = kit_compile(text);
    const char *said = strstr(kit_said, "mild.ground 'soft': ");
    print_message("%s\n", kit_said);
    assert_null(m);
    assert_non_null(said);
    assert_names(said, names);
    assert_null(strstr(said + 1, "mild.ground 'soft': ")); /* said once */
}

#define SHIN "<geom type='box' size='.1 .1 .1' " OFF "/>"
#define FOOT CONFIG("feet", "foot")

TEST(wrong_bodies_are_refused) {
    check_bad_body(FOOT CONFIG("body", "shim"), SHIN, "", "body shim shin");
    check_bad_body(FOOT CONFIG("body", "shin shin"), SHIN, "", "shin");
    check_bad_body(FOOT CONFIG("body", "shin foot"), SHIN, "", "foot");
    check_bad_body(CONFIG("sole", "") CONFIG("feet", "foot") CONFIG("body", "pole"), SHIN, "",
                   "pole world");
    check_bad_body(FOOT CONFIG("body", "shin"), "<site name='s'/>", "", "shin");
    check_bad_body(FOOT CONFIG("body", "shin"), "<geom type='box' size='20 20 20' " OFF "/>", "",
                   "shin 10");
    check_bad_body(FOOT CONFIG("body", "shin") CONFIG("body_pitch", "0.001"),
                   "<geom type='box' size='1 1 1' " OFF "/>", "", "shin elements");
    check_bad_body(FOOT CONFIG("body", "shin") CONFIG("body_pitch", "0"), SHIN, "",
                   "plugin.body_pitch 0");
    check_bad_body(CONFIG("body", "shin") CONFIG("ground.model", "bekker"), SHIN, "",
                   "bekker foot");
}

/* Bodies and feet are 16 together. */
TEST(seventeen_are_too_many) {
    static char names[300], world[4000], text[6000];
    names[0] = world[0] = '\0';
    for (int b = 1; b <= 16; b++) {
        snprintf(names + strlen(names), sizeof names - strlen(names), "b%d ", b);
        snprintf(world + strlen(world), sizeof world - strlen(world),
                 "<body name='b%d' pos='%d 0 1'><freejoint/>" SHIN "</body>", b, b);
    }
    for (int feet = 0; feet < 2; feet++) {
        snprintf(text, sizeof text,
                 "<mujoco><extension><plugin plugin='mild.ground'><instance name='soft'>%s<config "
                 "key='body' value='%s'/></instance></plugin></extension><worldbody>%s<body "
                 "name='foot'><freejoint/>" SHIN "</body></worldbody></mujoco>",
                 feet ? FOOT : "", names, world);
        kit_said[0] = '\0';
        mjModel *m = kit_compile(text);
        print_message("%s\n", kit_said);
        assert_int_equal(m == NULL, feet);
        assert_true(!feet || kit_named(kit_said, "16 b16"));
        if (m) {
            mjData *d = mj_makeData(m);
            kit_run(m, d, 1);
            assert_int_equal(plugin_soft(m, d)->near_rows, 96);
            mj_deleteData(d);
        }
        mj_deleteModel(m);
    }
}

/* A body that MuJoCo lets lie on its own floor too is warned about. */
TEST(a_rigid_floor_is_said) {
    for (int off = 0; off < 2; off++) {
        mjModel *m = body_of(off ? "<geom name='box' type='box' size='.1 .1 .1' " OFF "/>"
                                 : "<geom name='box' type='box' size='.1 .1 .1' pos='0 0 .3'/>",
                             "", "");
        assert_non_null(m);
        mjData *d = mj_makeData(m);
        print_message("%s\n", kit_said);
        assert_int_equal(kit_messages, !off);
        assert_true(off || kit_named(kit_said, "geom box body floor"));
        mj_deleteData(d);
        mj_deleteModel(m);
    }
}

/* A mesh of crossed sheets has more elements than its bounding box was given room for. */
TEST(a_folded_mesh_has_no_room) {
    static const int side[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                    {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                    {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    static char vertices[12000], faces[12000], asset[25000], text[27000];
    enum { SHEETS = 24 };
    vertices[0] = faces[0] = '\0';
    for (int s = 0; s < SHEETS; s++) {
        for (int c = 0; c < 8; c++) {
            double at[3];
            at[s % 3] = 0.05 * (s / 3 - 3.5) + (c & 4 ? .001 : -.001);
            at[(s + 1) % 3] = c & 1 ? .2 : -.2;
            at[(s + 2) % 3] = c & 2 ? .2 : -.2;
            snprintf(vertices + strlen(vertices), sizeof vertices - strlen(vertices), "%g %g %g ",
                     at[0], at[1], at[2]);
        }
        for (int t = 0; t < 12; t++) {
            snprintf(faces + strlen(faces), sizeof faces - strlen(faces), "%d %d %d ",
                     8 * s + side[t][0], 8 * s + side[t][1], 8 * s + side[t][2]);
        }
    }
    snprintf(asset, sizeof asset, "<mesh name='fold' vertex='%s' face='%s'/>", vertices, faces);
    snprintf(text, sizeof text,
             "<mujoco><extension><plugin plugin='mild.ground'><instance name='soft'>" CONFIG(
                 "body", "body") "</instance></plugin></extension><asset>%s</asset><worldbody>"
                                 "<body name='body'><freejoint/><geom type='mesh' mesh='fold' "
                                 "mass='1' " OFF "/></body></worldbody></mujoco>",
             asset);
    kit_said[0] = '\0';
    assert_null(kit_compile(text));
    print_message("%s\n", kit_said);
    assert_names(kit_said, "meshes body");
}

TEST_MAIN(kit_setup, NULL)
