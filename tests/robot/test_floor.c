/* Shells that stand on rigid ground, by MuJoCo: against mj_step with the geoms of the robot's file
 * on a plane. The batch engine's step is held to this one in engine/test_shells.c. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "all_robots.h"

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

TEST_MAIN(open_robots, close_robots)
