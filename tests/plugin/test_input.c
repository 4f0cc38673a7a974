/* What a user may get wrong in the MJCF: one message that names it, and no ground or no model. */
#include <math.h>

#include "materials.h"
#include "plugin_kit.h"

#define BODY                                                                                       \
    "<worldbody><geom name='floor' type='plane' size='1 1 .1' %s/><body name='pole'><geom "        \
    "name='post' size='.01'/></body><body name='foot' pos='0 0 .1' %s><freejoint/><geom "          \
    "name='box' mass='1' %s/><site name='sole' pos='0 0 -.01'/>"                                   \
    "<site name='end' euler='0 90 0'/><body name='b1'/><body name='b2'/><body name='b3'/><body "   \
    "name='b4'/><body name='b5'/><body name='b6'/><body name='b7'/><body name='b8'/><body "        \
    "name='b9'/><body name='b10'/><body name='b11'/><body name='b12'/><body name='b13'/><body "    \
    "name='b14'/><body name='b15'/><body name='b16'/></body></worldbody>"
#define BOX "type='box' size='.1 .05 .01' "

/* The model of the keys, with attributes of floor, body and foot and an end. */
static mjModel *compile(const char *option, const char *configs, const char *floor,
                        const char *body, const char *geom, const char *end) {
    char text[6000], world[1500];
    snprintf(world, sizeof world, BODY, floor, body, geom);
    snprintf(text, sizeof text,
             "<mujoco><option %s/><extension><plugin plugin='mild.ground'><instance "
             "name='soft'>%s</instance></plugin></extension>%s%s</mujoco>",
             option, configs, world, end);
    kit_messages = 0;
    kit_said[0] = '\0';
    return kit_compile(text);
}

#define OFF "contype='0' conaffinity='0'"
#define FOOT CONFIG("feet", "foot")
#define MANY "b1 b2 b3 b4 b5 b6 b7 b8 b9 b10 b11 b12 b13 b14 b15 b16"
#define LEG "leg_of_a_robot_with_a_very_long_name_"
#define LONG_NAME LEG LEG LEG LEG LEG

/* The model must not compile, with a message that names what is wrong. */
static void check_bad_keys(const char *option, const char *configs, const char *names) {
    mjModel *m = compile(option, configs, OFF, "", BOX OFF, "");
    print_message("%s\n",
                  strstr(kit_said, "mild.ground '") ? strstr(kit_said, "mild.ground '") : kit_said);
    assert_null(m);
    assert_names(kit_said, names);
    const char *first = strstr(kit_said, "mild.ground"); /* said once */
    assert_true(!first || !strstr(first + 1, "mild.ground 'soft': "));
}

TEST(refuses_what_is_wrong) {
    check_bad_keys("", "", "feet");
    check_bad_keys("", CONFIG("feet", "fool"), "fool foot");
    check_bad_keys("", CONFIG("feet", "foot " MANY), "16 b16");
    check_bad_keys("", CONFIG("feet", "pole foot foot"), "foot");
    check_bad_keys("", CONFIG("feet", "foot sole"), "foot sole");
    check_bad_keys("", CONFIG("feet", "end pole sole"), "end sole foot");
    check_bad_keys("", CONFIG("feet", "foot " LONG_NAME), LEG "leg_of_a_robot_with_a_v foot");
    check_bad_keys("", CONFIG("feet", "pole"), "pole world");
    check_bad_keys("", CONFIG("feet", "world"), "world");
    check_bad_keys("", FOOT CONFIG("sole", "bax"), "bax box");
    check_bad_keys("", FOOT CONFIG("sole", "post"), "sole post feet");
    check_bad_keys("", FOOT CONFIG("outline", "0 0 1 0"), "outline 4 3");
    check_bad_keys("", FOOT CONFIG("outline", "0 0 1 0 1 x"), "outline x");
    check_bad_keys("", FOOT CONFIG("outline", "0 0 1 0 1 1; 0 0 1 0 1 1"), "outline 2 1");
    check_bad_keys("", FOOT CONFIG("outline", "0 0 1 0 2 0"), "sole.outline");
    check_bad_keys("", FOOT CONFIG("outline", "-9 -9 9 -9 9 9 -9 9"), "sole.pitch 65536");
    check_bad_keys("", FOOT CONFIG("ground", "sand_lose"), "sand_lose sand_loose");
    check_bad_keys("", FOOT CONFIG("ground", "rigid"), "ground rigid");
    check_bad_keys("", FOOT CONFIG("ground", "grass rubber"), "plugin.ground 2 terrain.patches");
    check_bad_keys("", FOOT CONFIG("ground.model", "bekkers"), "ground.model bekkers bekker");
    check_bad_keys("", FOOT CONFIG("ground.model", "rigid"), "ground.model rigid");
    check_bad_keys("", FOOT CONFIG("ground", "clay") CONFIG("ground.k_c", "-690000"),
                   "ground.k_c -690000 ground.plate_width");
    check_bad_keys("",
                   FOOT CONFIG("ground", "clay") CONFIG("ground.k_c", "-9000")
                       CONFIG("ground.plate_width", "0.012"),
                   "ground.plate_width 0.012 0.013003 -k_c/k_phi");
    check_bad_keys("", FOOT CONFIG("ground", "clay") CONFIG("ground.model", "mild"),
                   "clay bekker ground.model");
    check_bad_keys("", FOOT CONFIG("ground.k_pen", "-1"), "ground.k_pen -1");
    check_bad_keys("", FOOT CONFIG("ground.k_pen", "much"), "ground.k_pen much");
    check_bad_keys("", FOOT CONFIG("ground.k_pan", "1"), "ground.k_pan");
    check_bad_keys("", FOOT CONFIG("pitch", "0"), "plugin.pitch 0");
    check_bad_keys("", FOOT CONFIG("prints", "-4"), "plugin.prints -4");
    check_bad_keys("", FOOT CONFIG("terrain.kind", "hills"), "terrain.kind hills");
    check_bad_keys("", FOOT CONFIG("terrain.kind", "image"), "terrain.kind image");
    check_bad_keys("integrator='RK4'", FOOT, "RK4 implicitfast");
}

/* A sensor of a ground that cannot be made does not hide why. */
TEST(a_sensor_hides_no_reason) {
    assert_null(compile("", CONFIG("feet", "fool"), OFF, "", BOX OFF,
                        "<sensor><plugin plugin='mild.ground' instance='soft'/></sensor>"));
    print_message("%s\n", kit_said);
    assert_names(kit_said, "fool");
}

/* Without passive forces MuJoCo leaves out a stage. */
TEST(disabled_flags) {
    const char *const off = "<option><flag spring='disable' damper='disable'/></option>";
    const char *const motor = "<option><flag spring='disable' damper='disable'/></option>"
                              "<actuator><motor site='sole' gear='0 0 0 0 0 1'/></actuator>";
    assert_null(compile("", FOOT, OFF, "", BOX OFF, off));
    print_message("%s\n", kit_said);
    assert_names(kit_said, "spring damper");
    mjModel *m = compile("", FOOT, OFF, "", BOX OFF, motor);
    assert_non_null(m);
    mjData *d = mj_makeData(m);
    m->opt.disableflags = 0; /* passive forces that are stale later */
    d->qpos[2] = 0.012;
    kit_run(m, d, 0.1);
    m->opt.disableflags = mjDSBL_SPRING | mjDSBL_DAMPER;
    for (int i = 0; i < 1000; i++) {
        mj_forward(m, d);
        mj_forwardSkip(m, d, mjSTAGE_VEL, 1);
        mj_step(m, d);
    }
    assert_true(d->qpos[2] < 0.01 && d->qpos[2] > 0);
    assert_true(fabs(d->qvel[2]) < 1e-6);
    mj_deleteData(d);
    mj_deleteModel(m);
}

TEST(refuses_a_second_instance) {
    kit_messages = 0;
    mjModel *m = kit_compile(
        "<mujoco><extension><plugin plugin='mild.ground'><instance name='a'>" FOOT
        "</instance><instance name='b'>" FOOT "</instance></plugin></extension><worldbody><body "
        "name='foot'><freejoint/><geom type='box' size='.1 .1 .1'/></body></worldbody></mujoco>");
    print_message("%s\n", kit_said);
    assert_null(m);
    assert_names(kit_said, "mild.ground instance");
}

/* Its data are made with a warning that has these names, which is said once for a model; NULL: with
 * none. */
static void expect_warning(mjModel *m, const char *names) {
    if (!m) {
        fail_msg("%s", kit_said);
    }
    mjData *first = mj_makeData(m), *second = mj_makeData(m);
    print_message("%s\n", kit_said);
    assert_int_equal(kit_messages, names != NULL);
    if (names) {
        assert_names(kit_said, names);
    }
    mj_deleteData(first);
    mj_deleteData(second);
    mj_deleteModel(m);
}

/* A foot that MuJoCo also lets stand on its own floor is warned about, whatever the way. */
TEST(warns_of_a_rigid_floor) {
    static const struct {
        const char *floor, *geom, *end;
        int warns;
    } cases[] = {
        {"", BOX, "", 1},
        {"", BOX OFF, "", 0},
        {OFF, BOX, "", 0},
        {"contype='0'", BOX, "", 1}, /* contype of one and conaffinity of the other are enough */
        {"", BOX "contype='2' conaffinity='2'", "", 0},
        {"", BOX, "<contact><exclude body1='world' body2='foot'/></contact>", 0},
        {OFF, BOX OFF, "<contact><pair geom1='box' geom2='floor'/></contact>", 1},
    };
    for (int c = 0; c < 7; c++) {
        expect_warning(compile("", FOOT, cases[c].floor, "", cases[c].geom, cases[c].end),
                       cases[c].warns ? "geom box floor contype" : NULL);
    }
}

TEST(warns_of_a_foot_that_lies_on_its_side) {
    expect_warning(compile("", FOOT, OFF, "euler='90 0 0'", BOX OFF, ""), "foot z");
}

/* Elements that have another area than the sole are said, unless their number is asked for. */
TEST(warns_of_another_area) {
    static const char *const keys[] = {
        FOOT CONFIG("pitch", "0.0195"), FOOT, FOOT CONFIG("elements", "12"),
        FOOT CONFIG("outline", "-.039 -.0195 .039 -.0195 .039 .0195 -.039 .0195")};
    for (int c = 0; c < 4; c++) {
        expect_warning(compile("", keys[c], OFF, "", "type='box' size='.04 .025 .02' " OFF, ""),
                       c == 0 ? "12 foot 1.14 40 cm2 pitch 0.0195" : NULL);
    }
}

/* Sensors of MuJoCo's that are meant for what carries a foot, and some that are not. */
TEST(warns_of_a_sensor_that_does_not_feel_the_ground) {
    static const struct {
        const char *sensor;
        int warns;
    } cases[] = {{"touch name='felt' site='sole'", 1},
                 {"force name='felt' site='sole'", 1},
                 {"torque name='felt' site='sole'", 1},
                 {"contact name='felt' body1='foot'", 1},
                 {"contact name='felt' geom1='box' geom2='floor'", 1},
                 {"contact name='felt' body1='foot' body2='b1'", 0},
                 {"accelerometer name='felt' site='sole'", 0},
                 {"touch name='felt' site='base'", 0},
                 {"plugin name='felt' plugin='mild.ground' instance='soft'", 0}};
    for (int c = 0; c < 9; c++) {
        char end[300];
        snprintf(end, sizeof end,
                 "<worldbody><site name='base'/></worldbody><sensor><%s/></sensor>",
                 cases[c].sensor);
        expect_warning(compile("", FOOT, OFF, "", BOX OFF, end),
                       cases[c].warns ? "sensor 'felt' 'foot' mild.ground" : NULL);
    }
}

/* A shin that comes down on a rigid floor beside a soft foot is said once; not where it is
 * excluded, soft, or another robot's. */
TEST(warns_of_a_body_that_a_rigid_floor_carries) {
    const struct {
        const char *keys, *shin;
        int warns;
    } cases[] = {{"", "", 1}, {"", OFF, 0}, {CONFIG("body", "shin"), OFF, 0}};
    for (int c = 0; c < 3; c++) {
        char text[3000];
        const int end = (int)strlen(kit_head(text, sizeof text, 0.002, "implicitfast", "foot",
                                             "sand_loose", cases[c].keys));
        snprintf(text + end, sizeof text - (size_t)end,
                 "<worldbody><geom name='floor' type='plane' size='1 1 .1'/><body name='other' "
                 "pos='0 .8 .05'><freejoint/><geom size='.05' mass='9'/></body><body name='shin' "
                 "pos='0 0 .2'><freejoint/><geom type='capsule' fromto='.1 0 0 .1 0 -.16' "
                 "size='.03' mass='5' %s/><geom type='capsule' fromto='-.1 0 0 -.1 0 -.16' "
                 "size='.03' mass='5' %s/><body name='foot' pos='0 0 -.19'><geom type='box' "
                 "size='.05 .05 .01' mass='1' " OFF "/></body></body></worldbody></mujoco>",
                 cases[c].shin, cases[c].shin);
        mjModel *m = kit_model(text);
        mjData *d = mj_makeData(m);
        kit_run(m, d, 0.5);
        mj_resetData(m, d);
        kit_run(m, d, 0.5);
        print_message("%d: %s\n", c, kit_messages ? kit_said : "-");
        assert_int_equal(kit_messages, cases[c].warns);
        if (cases[c].warns) {
            assert_names(kit_said, "'shin' floor rigid N body");
        }
        mj_deleteData(d);
        mj_deleteModel(m);
    }
}

#define WHEEL                                                                                      \
    "<mesh name='wheel' vertex='.1 .03 0 .0707 .03 .0707 0 .03 .1 -.0707 .03 .0707 -.1 .03 0 "     \
    "-.0707 .03 -.0707 0 .03 -.1 .0707 .03 -.0707 .0924 -.03 .0383 .0383 -.03 .0924 -.0383 -.03 "  \
    ".0924 -.0924 -.03 .0383 -.0924 -.03 -.0383 -.0383 -.03 -.0924 .0383 -.03 -.0924 .0924 -.03 "  \
    "-.0383'/>"

/* A sole that turns with a wheel is soon on top: refused with foot, and joint or geom. What only
 * looks like one is not. */
TEST(wheels_are_refused) {
    static const struct {
        const char *joint, *geom, *names;
    } cases[] = {
        {"<freejoint/>", "type='cylinder' size='.1 .03' euler='90 0 0'", "foot geom shape"},
        {"<freejoint/>", "type='capsule' size='.1 .03' euler='0 90 0'", "foot geom shape"},
        {"<freejoint/>", "type='ellipsoid' size='.1 .03 .1'", "foot geom shape"},
        {"<freejoint/>", "type='mesh' mesh='wheel'", "foot geom shape"},
        {"<freejoint/>", "type='sphere' size='.1'", NULL}, /* a round foot */
        {"<freejoint/>", "type='cylinder' size='.1 .03'", NULL},
        {"<freejoint/>", "type='ellipsoid' size='.1 .1 .02'", NULL},
        {"<joint name='axle' axis='0 1 0'/>", "type='cylinder' size='.1 .03' euler='90 0 0'",
         "foot joint axle"},
        {"<joint name='axle' axis='0 1 0' range='-40 40'/>",
         "type='cylinder' size='.1 .03' euler='90 0 0'", "foot joint axle"},
        {"<joint name='axle' axis='0 1 0' range='-20 20'/>",
         "type='cylinder' size='.1 .03' euler='90 0 0'", NULL}, /* an ankle */
        {"<joint name='axle' axis='0 0 1'/>", "type='cylinder' size='.1 .03'", NULL},
        {"<joint name='knee' axis='0 1 0' pos='0 0 .3'/>",
         "type='cylinder' size='.03 .03' euler='90 0 0'", NULL}, /* at the end of a leg */
        {"<joint name='knee' axis='0 1 0' pos='0 0 .3'/>", "size='.03'", NULL},
        {"<joint name='ankle' axis='0 1 0' pos='0 0 .05'/>", "type='box' size='.1 .05 .01'", NULL},
        {"<joint name='ankle' axis='1 0 0'/>",
         "type='capsule' size='.01 .1' euler='0 90 0' "
         "pos='0 .04 -.04' " OFF "/><geom type='capsule' size='.01 .1' euler='0 90 0' pos='0 -.04 "
         "-.04'",
         NULL},
    };
    for (int c = 0; c < (int)(sizeof cases / sizeof *cases); c++) {
        char text[3000];
        snprintf(text, sizeof text,
                 "<mujoco><extension><plugin plugin='mild.ground'><instance name='soft'>" FOOT
                 "</instance></plugin></extension><asset>" WHEEL "</asset><worldbody><body "
                 "name='foot'>%s<geom name='shape' mass='1' %s " OFF
                 "/></body></worldbody></mujoco>",
                 cases[c].joint, cases[c].geom);
        kit_said[0] = '\0';
        mjModel *m = kit_compile(text);
        print_message("%d: %s\n", c, kit_said);
        assert_int_equal(m == NULL, cases[c].names != NULL);
        if (cases[c].names) {
            assert_names(kit_said, cases[c].names);
        }
        mj_deleteModel(m);
    }
}

/* A foot that falls over is said by name, once. */
TEST(warns_of_a_tilted_sole) {
    mjModel *m = compile("", FOOT, OFF, "", BOX OFF, "");
    mjData *d = mj_makeData(m);
    for (int run = 1; run <= 2; run++) {
        mj_resetData(m, d);
        d->qpos[2] = 0.03;
        kit_run(m, d, 0.1);
        assert_int_equal(kit_tilts, run - 1);
        d->qpos[2] = 0.04;
        d->qpos[3] = cos(0.55);
        d->qpos[4] = sin(0.55); /* 63 degrees */
        kit_run(m, d, 0.1);
        print_message("%s\n", kit_tilted);
        assert_int_equal(kit_tilts, run);
        assert_names(kit_tilted, "foot");
    }
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* The integrator may be changed after compilation. */
TEST(rk4_at_run_time) {
    mjModel *m = compile("", FOOT, OFF, "", BOX OFF, "");
    mjData *d = mj_makeData(m);
    m->opt.integrator = mjINT_RK4;
    kit_messages = 0;
    for (int i = 0; i < 10; i++) {
        mj_step(m, d);
    }
    assert_int_equal(kit_messages, 1);
    assert_names(kit_said, "RK4");
    assert_true(fabs(d->qvel[2] + 9.81 * d->time) < 1e-9); /* falls */
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* ---- soles ---- */

/* Bool: the first sole's elements have this area [m^2] within 1 %. */
static int has_area(const char *configs, const char *geom, double area) {
    mjModel *m = compile("", configs, OFF, "", geom, "");
    if (!m) {
        fail_msg("%s", kit_said);
    }
    mjData *d = mj_makeData(m);
    const MildSole *sole = plugin_soft(m, d)->soles[0];
    const double pitch = mild_sole_pitch(sole), own = mild_sole_elements(sole) * pitch * pitch;
    print_message("%4d elements of %.2f mm: %.2f of %.2f cm2\n", mild_sole_elements(sole),
                  1e3 * pitch, 1e4 * own, 1e4 * area);
    mj_deleteData(d);
    mj_deleteModel(m);
    return fabs(own / area - 1) < 0.01;
}

/* Outlines from shapes, sites and numbers, whose elements have the sole's area. */
TEST(soles_follow_the_shapes) {
    assert_true(has_area(FOOT, BOX OFF, 0.02));
    assert_true(has_area(CONFIG("feet", "sole"), BOX OFF, 0.02));
    assert_true(has_area(CONFIG("sole", "box"), BOX OFF, 0.02));
    assert_true(has_area(FOOT CONFIG("elements", "40"), BOX OFF, 40 * 0.0195 * 0.0195));
    assert_true(has_area(FOOT CONFIG("outline", "-.1 -.1 .1 -.1 .1 .1 -.1 .1"), BOX OFF, 0.04));
    /* a site whose z axis is the long axis of the box: the sole is its end */
    assert_true(has_area(CONFIG("feet", "end"), BOX OFF, 0.002));
    /* what lies 80 mm above the sole is not the sole */
    assert_true(
        has_area(FOOT, BOX OFF "/><geom type='box' size='.3 .3 .01' pos='0 0 .08' " OFF, 0.02));
    assert_true(has_area(FOOT, "type='cylinder' size='.06 .02' " OFF, 3.1416 * 0.06 * 0.06));
    /* with a ledge, without which it would roll */
    assert_true(has_area(FOOT,
                         "type='capsule' size='.05 .1' euler='0 90 0' " OFF
                         "/><geom type='box' size='.01 .05 .001' pos='0 0 -.049' " OFF,
                         0.2 * 0.1 + 3.1416 * 0.05 * 0.05));
    /* what of it is within 10 mm of its lowest point */
    assert_true(has_area(FOOT, "type='ellipsoid' size='.12 .12 .01' " OFF, 3.1 * 0.12 * 0.12));
}

/* ---- keys ---- */

/* The ground of the keys, to be freed with its model. */
static const Soft *soft_of_keys(const char *configs, mjModel **m, mjData **d) {
    *m = compile(
        "", configs, OFF, "", BOX OFF,
        "<worldbody><body name='other' pos='3 0 1'><freejoint/><geom size='.1' mass='50'/></body>"
        "</worldbody>");
    if (!*m) {
        fail_msg("%s", kit_said);
    }
    *d = mj_makeData(*m);
    return plugin_soft(*m, *d);
}

static void free_both(mjModel *m, mjData *d) {
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* Each key does what the program's key of the same name does. */
TEST(keys_reach_the_ground) {
    mjModel *m;
    mjData *d;
    MildMaterial grass = kit_preset("grass");
    const Soft *soft = soft_of_keys(FOOT CONFIG("ground", "grass") CONFIG("ground.k_pen", "800")
                                        CONFIG("ground.mu", "0.25") CONFIG("height", "0.5"),
                                    &m, &d);
    const MildMaterial *material = soft->terrain.materials;
    assert_true(material->k_pen == 800 && material->mu == 0.25);
    assert_true(material->sigma_cone == grass.sigma_cone && material->recovery == grass.recovery);
    assert_true(mild_terrain_height_at(&soft->terrain, 3, 4) == 0.5);
    const mjtSize plain = m->npluginstate;
    free_both(m, d);

    soft =
        soft_of_keys(FOOT CONFIG("terrain.kind", "slope") CONFIG("terrain.slope", "0.2")
                         CONFIG("prints", "100") CONFIG("ground", "grass rubber")
                             CONFIG("terrain.patches", "stripes") CONFIG("terrain.patch_size", "1"),
                     &m, &d);
    assert_true(fabs(mild_terrain_height_at(&soft->terrain, 3, 4) - 0.6) < 1e-6);
    assert_int_equal(mild_terrain_material_at(&soft->terrain, 0.5, 0), 0);
    assert_int_equal(mild_terrain_material_at(&soft->terrain, 1.5, 0), 1);
    assert_true(soft->terrain.materials[0].k_pen == grass.k_pen);
    assert_true((m->npluginstate - plain) * 8 > 100 * 128);
    free_both(m, d);
}

static void check_match(const Soft *soft, const MildMaterial *material, double load) {
    const double wanted = mild_sole_sinkage(soft->soles[0], material, load);
    const double got = mild_sole_sinkage(soft->soles[0], soft->terrain.materials, load);
    assert_int_equal(soft->terrain.materials[0].model, MILD_MODEL_BEKKER);
    assert_true(fabs(got - wanted) < 0.001 * wanted);
}

/* Another model sinks as deep under the weight that a foot carries, and a concentric one has a
 * single element. */
TEST(models_are_matched) {
    mjModel *m;
    mjData *d;
    MildMaterial grass = kit_preset("grass");
    const Soft *soft =
        soft_of_keys(FOOT CONFIG("ground", "grass") CONFIG("ground.model", "bekker"), &m, &d);
    check_match(soft, &grass, 9.81);
    free_both(m, d);
    soft = soft_of_keys(CONFIG("feet", "foot other") CONFIG("ground", "grass")
                            CONFIG("ground.model", "bekker"),
                        &m, &d);
    check_match(soft, &grass, 9.81 / 2);
    free_both(m, d);
    soft = soft_of_keys(FOOT CONFIG("ground.model", "con_spring"), &m, &d);
    assert_int_equal(mild_sole_elements(soft->soles[0]), 1);
    free_both(m, d);
    soft = soft_of_keys(CONFIG("feet", "sole"), &m, &d); /* 10 mm below the body's origin */
    assert_true(fabs(mild_sole_z(soft->soles[0])) < 1e-12);
    free_both(m, d);
    soft = soft_of_keys(FOOT CONFIG("ground", "clay"), &m, &d);
    assert_int_equal(soft->terrain.materials[0].model, MILD_MODEL_BEKKER);
    free_both(m, d);
}

TEST_MAIN(kit_setup, NULL)
