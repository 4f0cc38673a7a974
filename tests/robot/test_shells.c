/* Shells that stand on soft ground carry the robot. That in the air, and where they do not stand,
 * they change no bit of a step is in plugin/test_body.c and env/test_shells.c, that the ground
 * under all bodies only takes energy in test_fallen.c. */
#include "all_robots.h"

#define FILES MILD_SOURCE_DIR "/robots/sa01"

enum { STAND_STEPS = 400 };

/* The law under a shell is that of the feet's elements, whatever the distance of its own; its area
 * is that of the geoms: the two boxes of SA01's shanks, 5 x 5 x 28 cm. */
TEST(they_have_the_law_of_the_feet) {
    for (int r = 0; r < ROBOTS; r++) {
        robot_set_shells(robots[r], 1);
        const MildSole *const *soles = robot_soles(robots[r]);
        for (int b = robot_feet(robots[r]); b < robot_bodies(robots[r]); b++) {
            assert_true(mild_sole_pitch(soles[b]) == mild_sole_pitch(soles[0]));
        }
    }
    const MildSole *shank = robot_soles(robots[0])[robot_bodies(robots[0]) - 1];
    double area = 0;
    for (int i = 0; i < mild_sole_elements(shank); i++) {
        area += mild_sole_surface_area(shank)[i];
    }
    assert_true(fabs(area - (4 * 0.05 * 0.28 + 2 * 0.05 * 0.05)) < 1e-12);
    assert_true(fabs(sqrt(area / mild_sole_elements(shank)) - 0.03) < 0.006);
}

/* ---- lying ---- */

/* Dropped on its back or side it comes to rest, and feet and shells carry its weight. */
TEST(they_carry_a_robot_that_lies) {
    static const char *const grounds[] = {"foam45", "sand_loose"};
    for (int n = 0; n < 2 * ROBOTS; n++) {
        Robot *robot = robots[n / 2];
        robot_set_shells(robot, 1);
        RobotSim *sim = robot_sim_create(robot, 0.0025, NULL);
        MildGround *ground = kit_ground(robot);
        MildTerrain terrain = kit_terrain(grounds[n % 2]);
        const RobotVariation nominal = robot_variation_nominal();
        RobotState state;
        robot_sim_store(sim, &state);
        state.qpos[2] = 0.5;
        state.qpos[3] = sqrt(0.5); /* on its back, or on its side */
        state.qpos[4 + (n / 2 != 1)] = -sqrt(0.5);
        robot_sim_load(sim, &state, &nominal);
        double torque[ROBOT_JOINTS_MAX], shells = 0, feet = 0;
        for (int s = 0; s < 4 * STAND_STEPS; s++) {
            hold_pose(robot, robot_default_pose(robot), 2, robot_sim_qpos(sim), robot_sim_qvel(sim),
                      torque);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
            if (s >= 3 * STAND_STEPS) {
                shells += robot_sim_shell_load(sim) / STAND_STEPS;
                for (int f = 0; f < robot_feet(robot); f++) {
                    feet += robot_sim_foot(sim, f)->force[2] / STAND_STEPS;
                }
            }
        }
        const double weight = 9.81 * robot_total_mass(robot);
        expect_near(grounds[n % 2], shells + feet, weight, 0.02 * weight);
        assert_true(shells > 0.2 * weight);
        free(ground);
        robot_sim_destroy(sim);
    }
}

/* ---- meshes ---- */

#define SHANK "<geom name=\"leg_l4_link_box\" class=\"body_box\" size=\"0.025 0.025 0.14\""

/* SA01 with the box of its left shank as a mesh, whose vertices are turned and far from the geom's
 * place. MuJoCo turns and moves them again. NULL: refused. */
static Robot *with_mesh(const char *faces, MildError *error) {
    char mesh[1024];
    snprintf(mesh, sizeof mesh,
             "<asset><mesh name=\"shank\" vertex=\"0.325 -0.025 -0.14  0.325 0.025 -0.14  "
             "0.275 0.025 -0.14  0.275 -0.025 -0.14  0.325 -0.025 0.14  0.325 0.025 0.14  "
             "0.275 0.025 0.14  0.275 -0.025 0.14\" face=\"%s\"/></asset>\n  <asset>",
             faces);
    char *ini = kit_read(FILES "/robot.ini", NULL), *plain = kit_read(FILES "/sa01.xml", NULL);
    char *with = kit_replaced(plain, "<asset>", mesh);
    char *mjcf = kit_replaced(with, SHANK " pos=\"0 0 -0.18\"",
                              "<geom name=\"leg_l4_link_box\" class=\"body_box\" type=\"mesh\" "
                              "mesh=\"shank\" quat=\"1 0 0 1\" pos=\"0 -0.3 -0.18\"");
    Robot *robot = kit_robot_of("sa01.xml", mjcf, ini, error);
    free(ini);
    free(plain);
    free(with);
    free(mjcf);
    return robot;
}

/* Corner c of the box of a shell [m]. */
static void corner_of(const RobotShell *shell, int c, double at[3]) {
    const double way[3] = {(c & 1 ? 1 : -1) * shell->half[0], (c & 2 ? 1 : -1) * shell->half[1],
                           (c & 4 ? 1 : -1) * shell->half[2]};
    mju_mulMatVec3(at, shell->rotation, way);
    mju_addTo3(at, shell->center);
}

/* Same corners, same area as the box that it is, on the same limb. */
TEST(a_mesh_is_a_shell) {
    MildError error = {0};
    Robot *mesh = with_mesh("0 2 1  0 3 2  4 5 6  4 6 7  0 1 5  0 5 4  1 2 6  1 6 5  2 3 7  2 7 6  "
                            "3 0 4  3 4 7",
                            &error);
    expect_good(mesh != NULL, &error);
    const RobotShell *box = &robots[0]->shell[1], *shell = &mesh->shell[1];
    assert_int_equal(shell->limb, box->limb);
    for (int c = 0; c < 8; c++) {
        double at[3], nearest = 1;
        corner_of(shell, c, at);
        for (int other = 0; other < 8; other++) {
            double corner[3];
            corner_of(box, other, corner);
            nearest = fmin(nearest, mju_dist3(at, corner));
        }
        assert_true(nearest < 1e-6);
    }
    robot_set_shells(mesh, 1);
    const MildSole *surface = robot_soles(mesh)[shell->limb];
    double area = 0;
    for (int i = 0; i < mild_sole_elements(surface); i++) {
        area += mild_sole_surface_area(surface)[i];
    }
    expect_near("area", area / (4 * 0.05 * 0.28 + 2 * 0.05 * 0.05), 1, 1e-5);
    robot_destroy(mesh);
}

/* Turned inward it is refused by name. */
TEST(an_inward_mesh_is_refused) {
    MildError error = {0};
    Robot *mesh = with_mesh("0 1 2  0 2 3  4 6 5  4 7 6  0 5 1  0 4 5  1 6 2  1 5 6  2 7 3  2 6 7  "
                            "3 4 0  3 7 4",
                            &error);
    assert_null(mesh);
    assert_true(error.status != MILD_OK);
}

TEST_MAIN(open_robots, close_robots)
