/* Shells that stand carry the robot: on rigid ground, by MuJoCo, against mj_step with the geoms of
 * the robot's file on a plane (the batch engine is held to this one in engine/test_shells.c); and
 * on soft ground. That in the air, and where they do not stand, they change no bit of a step is in
 * plugin/test_body.c and env/test_shells.c, that the ground under all bodies only takes energy in
 * test_fallen.c. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "all_robots.h"

#define FILES MILD_SOURCE_DIR "/robots/sa01"

/* ---- on rigid ground ---- */

static const double gravity = 9.81;

static RobotVariation rigid_variation(void) {
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = 1;
    variation.rigid_friction = 0.8;
    return variation;
}

static RobotSim *open_sim(Robot *robot, double dt) {
    robot_set_shells(robot, 1);
    RobotSim *sim = robot_sim_create(robot, dt, NULL);
    assert_non_null(sim);
    return sim;
}

/* ---- MuJoCo's own model ---- */

static void add_pair(mjSpec *spec, const char *geom) {
    static const double friction[5] = {0.8, 0.8, 0.005, 0.0001, 0.0001};
    mjsPair *pair = mjs_addPair(spec, NULL);
    mjs_setString(pair->geomname1, "plane");
    mjs_setString(pair->geomname2, geom);
    pair->condim = 3;
    memcpy(pair->friction, friction, sizeof friction);
}

/* The robot's file with a plane that its shells touch, as the geoms that they are, and the spheres
 * of its feet. */
static mjModel *own_model(const Robot *robot) {
    char text[256] = "";
    mjSpec *spec = mj_parseXML(robot->path, NULL, text, sizeof text);
    if (!spec) {
        fail_msg("%s", text);
    }
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_GEOM); e; e = mjs_nextElement(spec, e)) {
        mjs_asGeom(e)->contype = mjs_asGeom(e)->conaffinity = 0;
    }
    mjsGeom *plane = mjs_addGeom(mjs_findBody(spec, "world"), NULL);
    mjs_setName(plane->element, "plane");
    plane->type = mjGEOM_PLANE;
    plane->size[2] = 1;
    plane->contype = plane->conaffinity = 0;
    for (int s = 0; s < robot->def.shells; s++) {
        add_pair(spec, robot->def.shell[s]);
    }
    for (int f = 0; f < robot->def.feet; f++) {
        const RobotFootDef *foot = &robot->def.foot[f];
        for (int c = 0; c < foot->corner_count; c++) {
            char name[32];
            snprintf(name, sizeof name, "sphere_%d_%d", f, c);
            mjsGeom *sphere = mjs_addGeom(mjs_findBody(spec, foot->body), NULL);
            mjs_setName(sphere->element, name);
            sphere->type = mjGEOM_SPHERE;
            sphere->size[0] = foot->corner_radius;
            sphere->mass = 0;
            sphere->contype = sphere->conaffinity = 0;
            memcpy(sphere->pos, foot->corners + 3 * c, sizeof sphere->pos);
            add_pair(spec, name);
        }
    }
    mjModel *model = mj_compile(spec, NULL);
    assert_non_null(model);
    mj_deleteSpec(spec);
    return model;
}

/* Both from one state; `drive` gives the torques of either. */
typedef struct {
    mjModel *model;
    mjData *data;
    RobotSim *sim;
    MildTerrain terrain;
} Both;

static Both open_both(Robot *robot, const RobotState *state, double dt) {
    Both both = {.model = own_model(robot), .sim = open_sim(robot, dt)};
    const RobotVariation rigid = rigid_variation();
    both.terrain = kit_terrain("rubber");
    both.model->opt.timestep = dt;
    both.data = mj_makeData(both.model);
    assert_int_equal(both.model->nq, robot->nq);
    robot_engine_qpos(robot, state->qpos, both.data->qpos);
    robot_engine_rates(robot, state->qvel, both.data->qvel);
    robot_sim_load(both.sim, state, &rigid);
    return both;
}

static void close_both(Both *both) {
    robot_sim_destroy(both->sim);
    mj_deleteData(both->data);
    mj_deleteModel(both->model);
}

static void step_both(Both *both, const double *pose, double share) {
    const Robot *robot = both->sim->robot;
    double torque[ROBOT_JOINTS_MAX], qpos[ROBOT_NQ_MAX], qvel[ROBOT_NV_MAX];
    hold_pose(robot, pose, share, robot_sim_qpos(both->sim), robot_sim_qvel(both->sim), torque);
    assert_int_equal(robot_sim_step(both->sim, torque, NULL, &both->terrain, NULL), 0);
    for (int j = 0; j < robot->def.joints; j++) {
        qpos[7 + j] = both->data->qpos[robot->dof[j] + 1];
        qvel[6 + j] = both->data->qvel[robot->dof[j]];
    }
    hold_pose(robot, pose, share, qpos, qvel, torque);
    for (int j = 0; j < robot->def.joints; j++) {
        both->data->qfrc_applied[robot->dof[j]] = torque[j];
    }
    mj_step(both->model, both->data);
}

static double apart(const Both *both) {
    double most = 0;
    for (int i = 0; i < both->model->nq; i++) {
        most = fmax(most, fabs(both->data->qpos[i] - both->sim->data->qpos[i]));
    }
    return most;
}

/* SA01's shells are boxes, of which MuJoCo takes the corners as well: the same falls. */
TEST(boxes_are_those_of_mj_step) {
    double worst = 0;
    int loaded = 0;
    for (uint32_t draw = 0; draw < 12; draw++) {
        Random random = random_at(9, draw, 0);
        RobotState state = {.qpos = {0, 0, 0.9, 1, 0.2 * (draw % 3) - 0.2, 0.15 * (draw % 4), 0}};
        mju_normalize4(state.qpos + 3);
        for (int j = 0; j < robots[0]->def.joints; j++) {
            state.qpos[7 + j] = robots[0]->def.pose[j] + random_uniform(&random, -0.2, 0.2);
        }
        state.qvel[0] = random_uniform(&random, -1, 1);
        Both both = open_both(robots[0], &state, 0.001);
        for (int s = 0; s < 700; s++) {
            step_both(&both, robots[0]->def.pose, 0);
            loaded += robot_sim_shell_load(both.sim) > 0;
        }
        worst = fmax(worst, apart(&both));
        close_both(&both);
    }
    assert_true(loaded > 1000);
    expect_near("falls against mj_step with boxes", worst, 0, 1e-6);
}

/* ---- at rest ---- */

/* [N] Vertical force of mj_step's plane on the geoms of feet or shells. */
static double own_load(const Both *both, int shells) {
    double sum = 0;
    for (int c = 0; c < both->data->ncon; c++) {
        const mjContact *contact = both->data->contact + c;
        const char *name = mj_id2name(both->model, mjOBJ_GEOM, contact->geom[1]);
        double force[6];
        mj_contactForce(both->model, both->data, c, force);
        for (int k = 0; k < 3 && (strncmp(name, "sphere_", 7) != 0) == shells; k++) {
            sum += force[k] * contact->frame[3 * k + 2];
        }
    }
    return sum;
}

/* Legs folded. */
static void fold(const Robot *robot, double *pose) {
    for (int j = 0; j < robot->def.joints; j++) {
        pose[j] = robot->def.pose[j] + 0.6 * robot->def.swing[j];
        pose[j] = fmax(fmin(pose[j], robot->high[j] - 0.05), robot->low[j] + 0.05);
    }
}

typedef struct {
    double height, shells, feet; /* [m], [-] of the weight: mean over the last second */
    double own_height, own_shells, own_feet;
} Rest;

/* After four seconds. */
static Rest rest_of(Both *both, const double *pose) {
    enum { STEPS = 1600, LAST = 400 };
    const Robot *robot = both->sim->robot;
    const double weight = gravity * robot->total_mass;
    Rest rest = {0};
    for (int s = 0; s < STEPS; s++) {
        step_both(both, pose, 2);
        if (s < STEPS - LAST) {
            continue;
        }
        rest.height += robot_sim_qpos(both->sim)[2] / LAST;
        rest.own_height += both->data->qpos[2] / LAST;
        rest.shells += robot_sim_shell_load(both->sim) / weight / LAST;
        rest.own_shells += own_load(both, 1) / weight / LAST;
        rest.own_feet += own_load(both, 0) / weight / LAST;
        for (int f = 0; f < robot->def.feet; f++) {
            rest.feet += robot_sim_foot(both->sim, f)->force[2] / weight / LAST;
        }
    }
    return rest;
}

static void check_rest(const char *name, const Rest *rest) {
    print_message("%s: base at %.5f m, of mj_step %.5f m; shells carry %.4f of the weight and "
                  "%.4f, feet %.4f and %.4f\n",
                  name, rest->height, rest->own_height, rest->shells, rest->own_shells, rest->feet,
                  rest->own_feet);
    assert_true(fabs(rest->height - rest->own_height) < 1e-3);
    assert_true(fabs(rest->shells - rest->own_shells) < 0.005);
    assert_true(fabs(rest->feet - rest->own_feet) < 0.005);
    assert_true(fabs(rest->shells + rest->feet - 1) < 1e-3);
}

/* On its back and on either side a robot comes to rest where MuJoCo's own geoms do, and shells and
 * feet carry its weight. */
TEST(lying_robots_are_those_of_mj_step) {
    static const double half = 0.7071067811865476;
    const double turns[3][4] = {{0, 1, 0, 0}, {half, half, 0, 0}, {half, -half, 0, 0}};
    for (int n = 0; n < 3 * ROBOTS; n++) {
        Robot *robot = robots[n / 3];
        RobotState state = {.qpos = {0, 0, 0.6}};
        double pose[ROBOT_JOINTS_MAX];
        fold(robot, pose);
        memcpy(state.qpos + 3, turns[n % 3], sizeof turns[0]);
        memcpy(state.qpos + 7, pose, sizeof pose);
        Both both = open_both(robot, &state, 0.0025);
        const Rest rest = rest_of(&both, pose);
        check_rest(names[n / 3], &rest);
        assert_true(rest.shells > 0.5);
        close_both(&both);
    }
}

/* ---- on soft ground ---- */

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

/* Coarser rasters: area, centroid and second moments of area are those of the robot's own raster,
 * so a linear bed would answer with the same force and moment; and what is refused. */

enum { COUNTS = 4 };
static const int counts[COUNTS] = {77, 38, 20, 10}; /* of a foot of SA01 */

/* ---- equal moments ---- */

/* Integrals over the sole: 1, x, y, x^2, x y, y^2 about the ankle [m^2, m^3, m^4]. */
enum { INTEGRALS = 6 };
static void integrate(const MildSole *sole, double sum[INTEGRALS]) {
    const double area = mild_sole_pitch(sole) * mild_sole_pitch(sole);
    memset(sum, 0, INTEGRALS * sizeof *sum);
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        const double x = mild_sole_x(sole)[i], y = mild_sole_y(sole)[i];
        const double each[INTEGRALS] = {1, x, y, x * x, x * y, y * y};
        for (int k = 0; k < INTEGRALS; k++) {
            sum[k] += area * each[k];
        }
    }
}

/* The integrals of both, each relative to the largest that its lengths could make. */
static void expect_integrals(const MildSole *sole, const MildSole *own) {
    double got[INTEGRALS], wanted[INTEGRALS];
    integrate(sole, got);
    integrate(own, wanted);
    const double x = sqrt(wanted[3] / wanted[0]), y = sqrt(wanted[5] / wanted[0]);
    const double size[INTEGRALS] = {1, x, y, x * x, x * y, y * y};
    for (int k = 0; k < INTEGRALS; k++) {
        expect_entry("integral", k, got[k], wanted[k], 1e-12 * wanted[0] * size[k]);
    }
}

TEST(moments_are_those_of_the_own) {
    Robot *robot = robots[0];
    for (int c = 0; c < COUNTS; c++) {
        assert_int_equal(robot_set_elements(robot, counts[c], NULL), MILD_OK);
        for (int f = 0; f < robot_feet(robot); f++) {
            assert_int_equal(mild_sole_elements(robot_soles(robot)[f]), counts[c]);
            expect_integrals(robot_soles(robot)[f], robot_rasters(robot)[f]);
        }
    }
    /* the robot's own count is its own raster, and so is 0 */
    for (int k = 0; k < 2; k++) {
        assert_int_equal(robot_set_elements(robot, k ? 0 : 77, NULL), MILD_OK);
        assert_ptr_equal(robot_soles(robot)[1], robot_rasters(robot)[1]);
    }
}

/* The elements cover the sole: none is further than a cell from one of the own raster, and the
 * right foot is the mirror image of the left. */
TEST(elements_cover_the_sole) {
    Robot *robot = robots[0];
    for (int c = 0; c < COUNTS; c++) {
        assert_int_equal(robot_set_elements(robot, counts[c], NULL), MILD_OK);
        const MildSole *left = robot_soles(robot)[0], *right = robot_soles(robot)[1];
        const MildSole *own = robot_rasters(robot)[0];
        double apart = 0, mirrored = 0;
        for (int i = 0; i < counts[c]; i++) {
            const double x = mild_sole_x(left)[i], y = mild_sole_y(left)[i];
            double nearest = 1, image = 1;
            for (int k = 0; k < 77; k++) {
                nearest = fmin(nearest, hypot(mild_sole_x(own)[k] - x, mild_sole_y(own)[k] - y));
            }
            for (int k = 0; k < counts[c]; k++) {
                image = fmin(image, hypot(mild_sole_x(right)[k] - x, mild_sole_y(right)[k] + y));
            }
            apart = fmax(apart, nearest);
            mirrored = fmax(mirrored, image);
        }
        expect_entry("from the own", c, apart, 0, 0.71 * 0.0195);
        expect_entry("mirrored", c, mirrored, 0, 1e-12);
    }
    robot_set_elements(robot, 0, NULL);
}

/* ---- what is refused ---- */

static void refuse(int robot, int elements, MildStatus status, const char *named) {
    MildError error = {0};
    const MildSole *before = robot_soles(robots[robot])[0];
    assert_refused(robot_set_elements(robots[robot], elements, &error), status, &error, named);
    assert_ptr_equal(robot_soles(robots[robot])[0], before);
}

TEST(nonsense_is_refused) {
    refuse(0, 78, MILD_ERROR_RANGE, "foot.left 77");
    refuse(0, -1, MILD_ERROR_RANGE, "foot.left 77");
    refuse(0, 1, MILD_ERROR_RANGE, "foot.left 77");
    refuse(0, 4, MILD_ERROR_RANGE, "foot.left 77");
    refuse(1, 3, MILD_ERROR_ARGUMENT, "foot.FL round");
    robot_set_model(robots[0], MILD_MODEL_CON_SPRING);
    refuse(0, 20, MILD_ERROR_ARGUMENT, "model one element");
    assert_int_equal(robot_set_elements(robots[0], 0, NULL), MILD_OK);
    robot_set_model(robots[0], MILD_MODEL_MILD);
}

TEST_MAIN(open_robots, close_robots)
