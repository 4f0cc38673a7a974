/* Feet of meshes: while a model is compiled, and MuJoCo asks for the size of the state, meshes have
 * no vertices yet. The sole of a box of eight vertices is that of the geom of the same size. */
#include <math.h>

#include "plugin_kit.h"

#define OFF "contype='0' conaffinity='0'"
/* Half lengths that a float holds exactly, as a mesh's vertices are floats. */
#define VERTICES                                                                                   \
    "-.125 -.0625 -.015625 .125 -.0625 -.015625 -.125 .0625 -.015625 .125 .0625 -.015625 "         \
    "-.125 -.0625 .015625 .125 -.0625 .015625 -.125 .0625 .015625 .125 .0625 .015625"
#define BOX "<geom type='box' size='.125 .0625 .015625' mass='4' %s " OFF "/>"
#define SENSOR "<sensor><plugin name='felt' plugin='mild.ground' instance='soft'/></sensor>"

/* A foot of these geoms on sand, with meshes, more keys and more of the model. */
static mjModel *foot(const char *meshes, const char *geoms, const char *keys, const char *more) {
    char head[1500], text[9000];
    kit_head(head, sizeof head, 0.002, "implicitfast", "foot", "sand_loose", keys);
    snprintf(text, sizeof text,
             "%s%s<asset>%s</asset><worldbody><body name='foot' pos='0 0 .05'><freejoint/>%s<site "
             "name='tilted' pos='.01 0 0' euler='0 0 30'/></body></worldbody>%s</mujoco>",
             head, more, meshes, geoms, SENSOR);
    return kit_model(text);
}

static double sole_apart(const MildSole *a, const MildSole *b) {
    double worst = fabs(mild_sole_z(a) - mild_sole_z(b));
    assert_int_equal(mild_sole_elements(a), mild_sole_elements(b));
    for (int e = 0; e < mild_sole_elements(a); e++) {
        worst = fmax(worst, fabs(mild_sole_x(a)[e] - mild_sole_x(b)[e]));
        worst = fmax(worst, fabs(mild_sole_y(a)[e] - mild_sole_y(b)[e]));
    }
    return worst;
}

/* Both fall, tilted, and must do so alike. */
static void compare(const char *name, mjModel *mesh, mjModel *box, double bound) {
    mjData *d = mj_makeData(mesh), *e = mj_makeData(box);
    const double soles = sole_apart(plugin_soft(mesh, d)->soles[0], plugin_soft(box, e)->soles[0]);
    double steps = 0, load = 0;
    assert_int_equal(mesh->nsensordata, 12);
    d->qvel[3] = e->qvel[3] = 0.4;
    d->qvel[0] = e->qvel[0] = 0.3;
    for (int i = 0; i < 300; i++) {
        mj_step(mesh, d);
        mj_step(box, e);
        for (int k = 0; k < 7; k++) {
            steps = fmax(steps, fabs(d->qpos[k] - e->qpos[k]));
        }
        load = fmax(load, d->sensordata[2]);
    }
    print_message("%-10s soles apart by %.1e, steps by %.1e m, load %.0f N, state %d and %d\n",
                  name, soles, steps, load, (int)mesh->npluginstate, (int)box->npluginstate);
    assert_true(soles < bound);
    assert_true(steps < 1e3 * bound);
    assert_true(load > 40);
    assert_int_equal(kit_messages, 0);
    mj_deleteData(d);
    mj_deleteData(e);
    mj_deleteModel(mesh);
    mj_deleteModel(box);
}

#define MESH "<geom type='mesh' mesh='m' mass='4' " OFF "/>"
#define ASSET "<mesh name='m' vertex='" VERTICES "'/>"

static mjModel *plain(const char *keys, const char *more) {
    char geom[300];
    snprintf(geom, sizeof geom, BOX, "");
    return foot("", geom, keys, more);
}

TEST(a_box_mesh_is_a_box) {
    compare("inline", foot(ASSET, MESH, "", ""), plain("", ""), 1e-12);
    compare("scaled",
            foot("<mesh name='m' scale='.25 .125 .03125' vertex='-.5 -.5 -.5 .5 -.5 -.5 -.5 .5 -.5 "
                 ".5 .5 -.5 -.5 -.5 .5 .5 -.5 .5 -.5 .5 .5 .5 .5 .5'/>",
                 MESH, "", ""),
            plain("", ""), 1e-12);
    /* the compiler moves a mesh to its own centre and axes, and the geom with it */
    compare("refitted",
            foot("<mesh name='m' refpos='1 2 -3' refquat='.5 .5 .5 .5' vertex='" VERTICES "'/>",
                 "<geom type='mesh' mesh='m' mass='4' pos='1 2 -3' quat='.5 .5 .5 .5' " OFF "/>",
                 "", ""),
            plain("", ""), 1e-6);
    compare("class",
            foot(ASSET, "<geom class='sole'/>", "",
                 "<default><default class='sole'><geom type='mesh' mesh='m' mass='4' " OFF
                 "/></default></default>"),
            plain("", ""), 1e-12);
    compare("fitted",
            foot(ASSET, "<geom type='box' mesh='m' mass='4' " OFF "/>", "",
                 "<compiler fitaabb='true'/>"),
            plain("", ""), 1e-12);
    compare("forty", foot(ASSET, MESH, CONFIG("elements", "40"), ""),
            plain(CONFIG("elements", "40"), ""), 1e-12);
    compare("printing", foot(ASSET, MESH, CONFIG("prints", "64"), ""),
            plain(CONFIG("prints", "64"), ""), 1e-12);
    compare("concentric", foot(ASSET, MESH, CONFIG("ground.model", "con_spring"), ""),
            plain(CONFIG("ground.model", "con_spring"), ""), 1e-12);
}

/* Halves of the box, and what lies 80 mm above the sole, as in a maker's file. */
TEST(several_meshes_are_one_sole) {
    static const char half[] =
        "<mesh name='m' scale='.5 1 1' vertex='" VERTICES "'/><mesh name='shin' scale='2 2 2' "
        "vertex='" VERTICES "'/>";
    static const char halves[] =
        "<geom type='mesh' mesh='m' pos='.0625 0 0' mass='2' " OFF "/><geom type='mesh' mesh='m' "
        "pos='-.0625 0 0' mass='2' " OFF "/><geom type='mesh' mesh='shin' pos='0 0 .08' "
        "mass='1e-9' " OFF "/>";
    compare("halves", foot(half, halves, "", ""), plain("", ""), 1e-9);
}

/* Beside a shape, a mesh is for pictures, unless `sole` names it. */
TEST(meshes_beside_shapes) {
    static const char both[] = "<geom name='post' size='.01' mass='1e-9' " OFF "/>"
                               "<geom name='plate' type='mesh' mesh='m' mass='4' " OFF "/>";
    char geoms[600];
    compare("named", foot(ASSET, both, CONFIG("sole", "plate"), ""), plain("", ""), 1e-12);
    snprintf(geoms, sizeof geoms,
             BOX "<geom type='mesh' mesh='m' mass='1e-9' euler='0 0 90' " OFF "/>", "");
    compare("picture", foot(ASSET, geoms, "", ""), plain("", ""), 1e-12);
}

/* ---- any mesh ---- */

static double uniform(unsigned *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) / (1 << 24);
}

/* Vertices of a foot with round edges, somewhere, at any angle. */
static void random_meshes(char *asset, size_t size, char *geoms, size_t room, unsigned *seed) {
    const int meshes = 1 + (int)(3 * uniform(seed));
    size_t at = 0, end = 0;
    for (int k = 0; k < meshes; k++) {
        const double length = 0.02 + 0.15 * uniform(seed), width = 0.02 + 0.1 * uniform(seed);
        at += (size_t)snprintf(asset + at, size - at, "<mesh name='m%d' scale='%g %g %g' vertex='",
                               k, 0.5 + uniform(seed), 0.5 + uniform(seed), 0.5 + uniform(seed));
        for (int v = 0; v < 60; v++) {
            const double angle = 6.2832 * uniform(seed), high = 0.05 * uniform(seed) * (v % 3);
            at += (size_t)snprintf(asset + at, size - at, "%.7g %.7g %.7g ",
                                   length * cos(angle) + 0.1, width * sin(angle), high);
        }
        at += (size_t)snprintf(asset + at, size - at, "'/>");
        end += (size_t)snprintf(geoms + end, room - end,
                                "<geom type='mesh' mesh='m%d' pos='%g %g %g' euler='%g %g %g' " OFF
                                "/>",
                                k, 0.1 * uniform(seed), 0.1 * uniform(seed), 0.01 * uniform(seed),
                                40 * uniform(seed), 40 * uniform(seed), 360 * uniform(seed));
    }
}

/* The room that the compiler gave is enough for every sole, and little more than that. */
TEST(the_room_is_enough) {
    static char asset[8000], geoms[2000], text[12000];
    double most = 0, least = 1e9;
    int feet = 0;
    unsigned seed = 7;
    for (int n = 0; n < 400; n++) {
        char head[1000];
        random_meshes(asset, sizeof asset, geoms, sizeof geoms, &seed);
        kit_head(head, sizeof head, 0.002, "implicitfast", n % 2 ? "foot" : "tilted", "grass", "");
        snprintf(text, sizeof text,
                 "%s<asset>%s</asset><worldbody><body name='foot'><freejoint/>%s<site "
                 "name='tilted' euler='0 0 %g'/></body></worldbody></mujoco>",
                 head, asset, geoms, 90 * uniform(&seed));
        mjModel *m = kit_compile(text);
        if (!m) { /* stands on a single vertex or two */
            continue;
        }
        mjData *d = mj_makeData(m);
        const double used = (double)mild_ground_size((const MildGround *)(void *)d->plugin_state);
        most = fmax(most, 8 * (double)m->npluginstate / used);
        least = fmin(least, 8 * (double)m->npluginstate / used);
        feet++;
        mj_deleteData(d);
        mj_deleteModel(m);
    }
    print_message("%d feet, room over need %.2f to %.2f\n", feet, least, most);
    assert_true(feet > 200 && least >= 1);
}

TEST_MAIN(kit_setup, NULL)
