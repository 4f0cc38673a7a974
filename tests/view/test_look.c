#define _DEFAULT_SOURCE /* mkstemps */
/* Meshes of look.xml in pictures: of the makers' size, and without a part in the step. */
#include <unistd.h>

#include "base/paths.h"
#include "kit.h"
#include "robot/robot.h"
#include "view/model.h"

#define ROBOTS MILD_SOURCE_DIR "/robots/"
#define DRAWN 3 /* groups below it are drawn */

static mjModel *picture(const char *xml, const char *look, MildError *error) {
    MildMaterial sand;
    assert_true(mild_material_preset("sand_loose", &sand));
    const MildTerrain terrain = mild_terrain_uniform(&sand);
    Robot *robot = robot_create(ROBOTS "sa01", error);
    assert_non_null(robot);
    const ReliefDef def = {
        .cell = 0.02, .x_min = -1, .x_max = 1, .y_min = -1, .y_max = 1, .robots = 1};
    const int size[2] = {320, 240};
    const Surfaces surfaces = {1, 1};
    Relief *relief = relief_create(&def, &terrain, robot_soles(robot), robot_feet(robot), error);
    assert_non_null(relief);
    mjModel *model = view_model(xml, look, size, relief, &surfaces, error);
    relief_destroy(relief);
    robot_destroy(robot);
    return model;
}

/* How far a body's meshes reach along an axis of its frame, to the side of `sign`. */
static double reach(const mjModel *m, const char *name, int axis, int sign) {
    const int body = mj_name2id(m, mjOBJ_BODY, name);
    double most = -1e9;
    assert_true(body > 0);
    for (int g = m->body_geomadr[body]; g < m->body_geomadr[body] + m->body_geomnum[body]; g++) {
        const int mesh = m->geom_type[g] == mjGEOM_MESH ? m->geom_dataid[g] : -1;
        for (int v = 0; mesh >= 0 && v < m->mesh_vertnum[mesh]; v++) {
            const float *at = m->mesh_vert + 3 * (m->mesh_vertadr[mesh] + v);
            const double local[3] = {at[0], at[1], at[2]};
            double turned[3];
            mju_rotVecQuat(turned, local, m->geom_quat + 4 * g);
            most = fmax(most, sign * (turned[axis] + m->geom_pos[3 * g + axis]));
        }
    }
    return most;
}

/* Bodies of the drawn model are those without meshes, and nothing but meshes is drawn of them. */
static void check_robot(const char *name, int most_faces) {
    char xml[PATH_SIZE], look[PATH_SIZE];
    MildError error = {0};
    snprintf(xml, sizeof xml, ROBOTS "%s/%s.xml", name, name);
    snprintf(look, sizeof look, ROBOTS "%s/look.xml", name);
    mjModel *plain = picture(xml, NULL, &error), *drawn = picture(xml, look, &error);
    if (!plain || !drawn) {
        fail_msg("%s", error.text);
    }
    assert_int_equal(drawn->nbody, plain->nbody);
    assert_int_equal(drawn->nq, plain->nq);
    int meshes = 0, shapes = 0, faces = 0;
    for (int b = 1; b < plain->nbody; b++) {
        expect_entry("mass", b, drawn->body_mass[b], plain->body_mass[b], 0);
        for (int k = 0; k < 3; k++) {
            expect_entry("pos", b, drawn->body_pos[3 * b + k], plain->body_pos[3 * b + k], 0);
            expect_entry("inertia", b, drawn->body_inertia[3 * b + k],
                         plain->body_inertia[3 * b + k], 0);
        }
    }
    for (int g = 0; g < drawn->ngeom; g++) {
        const int mesh = drawn->geom_type[g] == mjGEOM_MESH;
        assert_int_equal(drawn->geom_contype[g] | drawn->geom_conaffinity[g], 0);
        assert_int_equal(drawn->geom_group[g] < DRAWN, mesh);
        meshes += mesh;
        shapes += !mesh;
        faces += mesh ? drawn->mesh_facenum[drawn->geom_dataid[g]] : 0;
    }
    print_message("%s: %d meshes of %d triangles over %d shapes\n", name, meshes, faces, shapes);
    assert_int_equal(shapes, plain->ngeom);
    assert_in_range(faces, 10000, most_faces);
    mj_deleteModel(plain);
    mj_deleteModel(drawn);
}

TEST(meshes_are_drawn_alone) {
    check_robot("g1", 70000);
    check_robot("go1", 70000);
}

/* The makers' feet end where robot.ini has the sole, or the lowest point of a round foot. */
TEST(feet_end_at_the_soles) {
    MildError error = {0};
    mjModel *g1 = picture(ROBOTS "g1/g1.xml", ROBOTS "g1/look.xml", &error);
    mjModel *go1 = picture(ROBOTS "go1/go1.xml", ROBOTS "go1/look.xml", &error);
    assert_non_null(g1);
    assert_non_null(go1);
    expect_near("G1, left", reach(g1, "left_ankle_roll_link", 2, -1), 0.035, 0.002);
    expect_near("G1, right", reach(g1, "right_ankle_roll_link", 2, -1), 0.035, 0.002);
    static const char *const calves[] = {"FR_calf", "FL_calf", "RR_calf", "RL_calf"};
    for (int f = 0; f < 4; f++) {
        expect_near(calves[f], reach(go1, calves[f], 2, -1), 0.213 + 0.023, 0.004);
    }
    /* what is mirrored or turned lies on its side: motors outside of hips, in front or behind */
    const double out = reach(g1, "left_hip_pitch_link", 1, 1);
    assert_true(out > reach(g1, "left_hip_pitch_link", 1, -1) + 0.02);
    expect_near("G1, right hip", reach(g1, "right_hip_pitch_link", 1, -1), out, 1e-5);
    const double back = reach(go1, "FL_hip", 0, -1);
    assert_true(fabs(back - reach(go1, "FL_hip", 0, 1)) > 0.001);
    expect_near("FR_hip", reach(go1, "FR_hip", 0, -1), back, 1e-5);
    expect_near("RR_hip", reach(go1, "RR_hip", 0, 1), back, 1e-5);
    expect_near("RL_hip", reach(go1, "RL_hip", 0, 1), back, 1e-5);
    mj_deleteModel(g1);
    mj_deleteModel(go1);
}

TEST(wrong_looks_are_one_line) {
    static const struct {
        const char *text, *names;
        MildStatus status;
    } wrong[] = {{"<asset><mesh name='a' file='a.msh'/></asset><worldbody><body name='nose'>"
                  "<geom type='mesh' mesh='a'/></body></worldbody>",
                  "nose", MILD_ERROR_FORMAT},
                 {"<worldbody><body name='pelvis'><geom size='1'/></body></worldbody>",
                  "pelvis mesh", MILD_ERROR_FORMAT},
                 {"<asset><mesh name='a' file='a.msh'/></asset><worldbody><body name='pelvis'>"
                  "<geom type='mesh' mesh='a' euler='0 0 1'/></body></worldbody>",
                  "pelvis quat", MILD_ERROR_FORMAT},
                 {"<asset><mesh name='a' file='a.msh'/></asset><worldbody><body name='pelvis'>"
                  "<geom type='mesh' mesh='a'/></body></worldbody>",
                  "a.msh", MILD_ERROR_FORMAT},
                 {"<worldbody>", "XML worldbody", MILD_ERROR_FORMAT}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char path[] = "look_XXXXXX.xml";
        FILE *file = fdopen(mkstemps(path, 4), "w");
        MildError error = {0};
        assert_non_null(file);
        fprintf(file, "<mujoco>%s</mujoco>", wrong[i].text);
        fclose(file);
        assert_null(picture(ROBOTS "g1/g1.xml", path, &error));
        print_message("%s\n", error.text);
        assert_error(&error, wrong[i].status, wrong[i].names);
        unlink(path);
    }
}

int main(void) {
    return run_cases(NULL, NULL);
}
