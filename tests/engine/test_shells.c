/* Bodies whose shells are on soft ground, in the engine and by MuJoCo: robots fall with shells that
 * stand, and in each step the engine begins where MuJoCo's robot is. Pose, twist, V_free and A of
 * feet and bodies are the same, and so is the next velocity under the same wrenches. In double. */
#include <stdio.h>

#include "falls.h"

#include "robot/engine/shells.h"

enum { FALLS = 12, ROWS_MOST = 6 * (ROBOT_FEET_MAX + ENGINE_BODIES_MAX) };

/* What the engine gives and takes. */
typedef struct {
    EngineWork work;
    EngineSaved saved;
    EngineSavedLinks links;
    EngineShells shells;
    double position[ENGINE_BODIES_MAX][3], rotation[ENGINE_BODIES_MAX][9];
    double velocity[ENGINE_BODIES_MAX][6], free_velocity[6 * ENGINE_BODIES_MAX];
    double before[ENGINE_BODIES_MAX][6]; /* twists by engine_body_twist */
    double inverse_inertia[ROWS_MOST * ROWS_MOST];
} Engine;

typedef struct {
    double pose, twist, inertia, rate;
    int steps, bodies, limited;
} Worst;

static double apart(const double *a, const double *b, int count) {
    double most = 0, size = 1e-3;
    for (int i = 0; i < count; i++) {
        most = worse(most, fabs(a[i] - b[i]));
        size = fmax(size, fabs(b[i]));
    }
    return most / size;
}

/* The state of MuJoCo's robot. */
static void engine_take(const EngineModel *model, const RobotState *state, Engine *e) {
    memset(e, 0xff, sizeof *e);
    engine_load(model, state->qpos, state->qvel, &e->work);
    for (int d = 0; d < 6 + model->tree.joints; d++) {
        e->work.acceleration[d] = state->qacc[d < 6 ? d : 6 + model->tree.joint[d - 5]];
    }
}

/* A step up to the ground, with the bodies that MuJoCo's robot had near the ground. */
static void engine_first(const EngineModel *model, const RobotSim *sim, const double *torque,
                         Engine *e) {
    EngineVariation variation = {.armature_scale = 1};
    for (int i = 0; i < ENGINE_LINKS_MAX; i++) {
        variation.link_mass_scale[i] = 1;
    }
    const EngineAction action = {&variation, torque, NULL, 0};
    const EngineShellsGround ground = {e->position, e->rotation, e->velocity, e->free_velocity,
                                       e->inverse_inertia};
    engine_begin(model, &action, &e->work);
    engine_save(&model->tree, 0, &e->work, &e->saved);
    engine_save_links(&model->tree, &e->work, &e->links);
    e->shells.count = sim->rows - model->tree.feet;
    for (int i = 0; i < e->shells.count; i++) {
        e->shells.body[i] = sim->row[model->tree.feet + i] - model->tree.feet;
    }
    for (int i = 0; i < e->shells.count; i++) {
        const EngineLinks links = engine_links_of(&e->work);
        double position[3], rotation[9];
        engine_body_pose(model, &links, e->shells.body[i], position, rotation);
        engine_body_twist(&model->tree, &links, e->work.rate, e->shells.body[i], position,
                          e->before[i]);
    }
    engine_shells_begin(model, &e->saved, &e->links, &e->shells, &ground);
}

/* And from it, under the wrenches of MuJoCo's robot. */
static void engine_second(const EngineModel *model, const RobotSim *sim, Engine *e) {
    double wrench[ENGINE_BODIES_MAX][6];
    for (int i = 0; i < sim->rows; i++) {
        const MildFootResult *body = &sim->contact.foot[sim->row[i]];
        const int foot = i < model->tree.feet;
        double *to = foot ? e->work.wrench[i] : wrench[i - model->tree.feet];
        memcpy(to, body->force, 3 * sizeof *to);
        memcpy(to + 3, body->torque, 3 * sizeof *to);
    }
    double feet[ENGINE_FEET][6];
    memcpy(feet, e->work.wrench, sizeof feet);
    engine_shells_end(&model->tree, &e->shells, wrench[0], &e->saved);
    memset(&e->work, 0xff, sizeof e->work);
    engine_restore(&model->tree, 0, &e->saved, &e->work);
    memcpy(e->work.wrench, feet, sizeof feet);
    assert_int_equal(engine_end(model, 0, &e->work), 0);
}

static void compare(const EngineModel *model, const RobotSim *sim, const Engine *e, Worst *worst) {
    const MildContactInput *in = &sim->input;
    const int feet = model->tree.feet, rows = 6 * sim->rows;
    for (int i = 0; i < e->shells.count; i++) {
        const int b = sim->row[feet + i];
        double twist[6];
        worst->pose = worse(worst->pose, apart(e->position[i], in->position[b], 3));
        worst->pose = worse(worst->pose, apart(e->rotation[i], in->rotation[b], 9));
        memcpy(twist, in->velocity[b], sizeof twist);
        worst->twist = worse(worst->twist, apart(e->velocity[i], twist, 6));
        worst->twist = worse(worst->twist, apart(e->before[i], twist, 6));
        memcpy(twist, in->free_velocity + 6 * b, sizeof twist);
        worst->twist = worse(worst->twist, apart(e->free_velocity + 6 * i, twist, 6));
    }
    for (int r = 0; r < rows; r++) { /* of two feet, engine_foot_inertia has them */
        const int from = r < 6 * feet ? 6 * feet : 0;
        worst->inertia =
            worse(worst->inertia, apart(e->inverse_inertia + r * rows + from,
                                        in->inverse_inertia + r * rows + from, rows - from));
    }
    double rate[ROBOT_NV_MAX];
    for (int d = 0; d < 6 + model->tree.joints; d++) {
        rate[d] = robot_sim_qvel(sim)[d < 6 ? d : 6 + model->tree.joint[d - 5]];
    }
    worst->rate = worse(worst->rate, apart(e->work.rate, rate, 6 + model->tree.joints));
    worst->steps++;
    worst->bodies += e->shells.count;
    worst->limited += e->work.newton > 0;
}

static void fall(const Robot *robot, const EngineModel *model, RobotSim *sim, MildGround *ground,
                 uint32_t number, Worst *worst) {
    static Engine engine;
    Random random = random_at(5, number, 0);
    const MildTerrain terrain = kit_terrain(number % 2 ? "foam45" : "sand_loose");
    const RobotVariation nominal = robot_variation_nominal();
    RobotState state = random_state(robot, &random);
    mild_ground_reset(ground);
    robot_sim_load(sim, &state, &nominal);
    for (int s = 0; s < FALL_STEPS; s++) {
        double torque[ROBOT_JOINTS_MAX];
        random_torque(robot, &random, torque);
        robot_sim_store(sim, &state);
        if (robot_sim_step(sim, torque, NULL, &terrain, ground)) {
            return;
        }
        if (sim->rows > robot->def.feet) {
            engine_take(model, &state, &engine);
            engine_first(model, sim, torque, &engine);
            engine_second(model, sim, &engine);
            compare(model, sim, &engine, worst);
        }
    }
}

TEST(bodies_are_those_of_mujoco) {
    for (int r = 0; r < ROBOTS; r++) {
        Robot *robot = kit_robot_named(names[r]);
        robot_set_shells(robot, 1);
        EngineModel *model = read_model(robot);
        assert_int_equal(model->tree.bodies, robot_bodies(robot) - robot_feet(robot));
        RobotSim *sim = robot_sim_create(robot, dt, NULL);
        sim->model->opt.tolerance = 1e-15;
        MildGround *ground = kit_ground(robot);
        Worst worst = {0};
        for (uint32_t n = 0; n < FALLS; n++) {
            fall(robot, model, sim, ground, n, &worst);
        }
        print_message("%s: %d steps with %.1f bodies near the ground, %d at limits; worst pose "
                      "%.1e, twist %.1e, A %.1e, next velocity %.1e\n",
                      names[r], worst.steps, (double)worst.bodies / worst.steps, worst.limited,
                      worst.pose, worst.twist, worst.inertia, worst.rate);
        assert_true(worst.steps > 500 && worst.bodies > worst.steps);
        assert_true(worst.pose < 1e-12 && worst.twist < 1e-10 && worst.inertia < 1e-10);
        assert_true(worst.rate < 1e-10);
        free(ground);
        robot_sim_destroy(sim);
        free(model);
        robot_destroy(robot);
    }
}

/* Without them the engine knows of none. */
TEST(shells_that_do_not_stand_have_no_bodies) {
    Robot *robot = robot_open("sa01", NULL);
    assert_non_null(robot);
    EngineModel *model = read_model(robot);
    assert_int_equal(model->tree.bodies, 0);
    free(model);
    robot_destroy(robot);
}

TEST_MAIN(NULL, NULL)
