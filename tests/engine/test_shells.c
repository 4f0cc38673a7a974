/* Bodies whose shells stand on the ground, in the engine and by MuJoCo: robots fall, and in each
 * step the engine begins where MuJoCo's robot is. On soft ground pose, twist, V_free and A of feet
 * and bodies are the same, and so is the next velocity under the same wrenches; on rigid ground,
 * level or in waves, the next velocity, the feet's wrenches and the load on the shells. In double.
 */
#include <stdio.h>

#include "base/random.h"
#include "ground/terrain/grid.h"
#include "robot/engine/read.h"
#include "robot/engine/shells.h"
#include "robot/engine/step.h"
#include "robot/sim.h"
#include "robots.h"

enum {
    ROBOTS = 3,
    SOFT_FALLS = 12,
    RIGID_FALLS = 24,
    FALL_STEPS = 300,
    ROWS_MOST = 6 * (ROBOT_FEET_MAX + ENGINE_BODIES_MAX)
};
static const char *const names[ROBOTS] = {"sa01", "go1", "g1"};
static const double dt = 0.0025;

/* A robot by both. */
typedef struct {
    Robot *robot;
    EngineModel *model;
    RobotSim *sim;
} Both;

static Both open_both(const char *name) {
    MildError error = {0};
    Both both = {kit_robot_named(name), calloc(1, sizeof(EngineModel)), NULL};
    assert_non_null(both.model);
    robot_set_shells(both.robot, 1);
    expect_good(engine_model_read(both.robot, dt, &both.model->tree,
                                  (double *)(void *)&both.model->number, &error) == MILD_OK,
                &error);
    both.sim = robot_sim_create(both.robot, dt, NULL);
    both.sim->model->opt.tolerance = 1e-15;
    return both;
}

static void close_both(Both *both) {
    robot_sim_destroy(both->sim);
    free(both->model);
    robot_destroy(both->robot);
}

static double worse(double a, double b) {
    return !(a > b) && a == a ? b : a; /* NaN where one is */
}

/* In the air, with any attitude and any joints. */
static RobotState random_state(const Robot *robot, Random *random) {
    RobotState state = {.qpos = {random_uniform(random, -1, 1), 0, 0.5}};
    for (int k = 3; k < 7; k++) {
        state.qpos[k] = random_normal(random);
    }
    mju_normalize4(state.qpos + 3);
    for (int j = 0; j < robot->def.joints; j++) {
        state.qpos[7 + j] = random_uniform(random, robot->low[j], robot->high[j]);
    }
    for (int d = 0; d < robot->nv; d++) {
        state.qvel[d] = random_uniform(random, -1, 1);
    }
    return state;
}

static void random_torque(const Robot *robot, Random *random, double *torque) {
    for (int j = 0; j < robot->def.joints; j++) {
        torque[j] = 0.1 * robot->effort[j] * random_uniform(random, -1, 1);
    }
}

/* What the engine gives and takes. */
typedef struct {
    EngineWork work;
    EngineSaved saved;
    EngineSavedLinks links;
    EngineShells shells; /* on soft ground */
    EngineFloor floor;   /* on rigid ground */
    double position[ENGINE_BODIES_MAX][3], rotation[ENGINE_BODIES_MAX][9];
    double velocity[ENGINE_BODIES_MAX][6], free_velocity[6 * ENGINE_BODIES_MAX];
    double before[ENGINE_BODIES_MAX][6]; /* twists by engine_body_twist */
    double inverse_inertia[ROWS_MOST * ROWS_MOST];
} Engine;

static Engine engine;

/* The state of MuJoCo's robot, and the step up to the ground. */
static void engine_take(const EngineModel *model, const RobotState *state, const double *torque,
                        int rigid) {
    EngineVariation nominal = {.armature_scale = 1};
    for (int i = 0; i < ENGINE_LINKS_MAX; i++) {
        nominal.link_mass_scale[i] = 1;
    }
    const EngineAction action = {&nominal, torque, NULL, rigid};
    memset(&engine, 0xff, sizeof engine);
    engine_load(model, state->qpos, state->qvel, &engine.work);
    for (int d = 0; d < 6 + model->tree.joints; d++) {
        engine.work.acceleration[d] = state->qacc[d < 6 ? d : 6 + model->tree.joint[d - 5]];
    }
    engine_begin(model, &action, &engine.work);
}

/* [-] Largest difference of the next velocity, of its largest component. */
static double rates_apart(const EngineModel *model, const RobotSim *sim) {
    double most = 0, size = 1e-3;
    for (int d = 0; d < 6 + model->tree.joints; d++) {
        const double rate = robot_sim_qvel(sim)[d < 6 ? d : 6 + model->tree.joint[d - 5]];
        most = worse(most, fabs(engine.work.rate[d] - rate));
        size = fmax(size, fabs(rate));
    }
    return most / size;
}

/* ---- soft ground ---- */

typedef struct {
    double pose, twist, inertia, rate;
    int steps, bodies, limited;
} Soft;

static double apart(const double *a, const double *b, int count) {
    double most = 0, size = 1e-3;
    for (int i = 0; i < count; i++) {
        most = worse(most, fabs(a[i] - b[i]));
        size = fmax(size, fabs(b[i]));
    }
    return most / size;
}

/* With the bodies that MuJoCo's robot had near the ground. */
static void shells_begin(const EngineModel *model, const RobotSim *sim) {
    Engine *e = &engine;
    const EngineShellsGround ground = {e->position, e->rotation, e->velocity, e->free_velocity,
                                       e->inverse_inertia};
    engine_save(&model->tree, 0, &e->work, &e->saved);
    engine_save_links(&model->tree, &e->work, &e->links);
    e->shells.count = sim->rows - model->tree.feet;
    for (int i = 0; i < e->shells.count; i++) {
        const EngineLinks links = engine_links_of(&e->work);
        double position[3], rotation[9];
        e->shells.body[i] = sim->row[model->tree.feet + i] - model->tree.feet;
        engine_body_pose(model, &links, e->shells.body[i], position, rotation);
        engine_body_twist(&model->tree, &links, e->work.rate, e->shells.body[i], position,
                          e->before[i]);
    }
    engine_shells_begin(model, &e->saved, &e->links, &e->shells, &ground);
}

/* The rest of the step, under the wrenches of MuJoCo's robot. */
static void shells_end(const EngineModel *model, const RobotSim *sim) {
    Engine *e = &engine;
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

static void compare_soft(const EngineModel *model, const RobotSim *sim, Soft *worst) {
    const Engine *e = &engine;
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
    worst->rate = worse(worst->rate, rates_apart(model, sim));
    worst->steps++;
    worst->bodies += e->shells.count;
    worst->limited += e->work.newton > 0;
}

static void fall_soft(const Both *both, MildGround *ground, uint32_t number, Soft *worst) {
    RobotSim *sim = both->sim;
    Random random = random_at(5, number, 0);
    const MildTerrain terrain = kit_terrain(number % 2 ? "foam45" : "sand_loose");
    const RobotVariation nominal = robot_variation_nominal();
    RobotState state = random_state(both->robot, &random);
    mild_ground_reset(ground);
    robot_sim_load(sim, &state, &nominal);
    for (int s = 0; s < FALL_STEPS; s++) {
        double torque[ROBOT_JOINTS_MAX];
        random_torque(both->robot, &random, torque);
        robot_sim_store(sim, &state);
        if (robot_sim_step(sim, torque, NULL, &terrain, ground)) {
            return;
        }
        if (sim->rows > both->robot->def.feet) {
            engine_take(both->model, &state, torque, 0);
            shells_begin(both->model, sim);
            shells_end(both->model, sim);
            compare_soft(both->model, sim, worst);
        }
    }
}

TEST(bodies_are_those_of_mujoco) {
    for (int r = 0; r < ROBOTS; r++) {
        Both both = open_both(names[r]);
        assert_int_equal(both.model->tree.bodies,
                         robot_bodies(both.robot) - robot_feet(both.robot));
        MildGround *ground = kit_ground(both.robot);
        Soft worst = {0};
        for (uint32_t n = 0; n < SOFT_FALLS; n++) {
            fall_soft(&both, ground, n, &worst);
        }
        print_message("%s: %d steps with %.1f bodies near the ground, %d at limits; worst pose "
                      "%.1e, twist %.1e, A %.1e, next velocity %.1e\n",
                      names[r], worst.steps, (double)worst.bodies / worst.steps, worst.limited,
                      worst.pose, worst.twist, worst.inertia, worst.rate);
        assert_true(worst.steps > 500 && worst.bodies > worst.steps);
        assert_true(worst.pose < 1e-12 && worst.twist < 1e-10 && worst.inertia < 1e-10);
        assert_true(worst.rate < 1e-10);
        free(ground);
        close_both(&both);
    }
}

/* Without them the engine knows of none. */
TEST(shells_that_do_not_stand_have_no_bodies) {
    static EngineModel model;
    Robot *robot = kit_robot_named("sa01");
    assert_int_equal(
        engine_model_read(robot, dt, &model.tree, (double *)(void *)&model.number, NULL), MILD_OK);
    assert_int_equal(model.tree.bodies, 0);
    robot_destroy(robot);
}

/* ---- rigid ground ---- */

typedef struct {
    double rate, wrench, load;
    int steps, points, bodies, limited, newton, missed, idle;
} Rigid;

/* A step of the engine from MuJoCo's state. Returns whether a shell touches. */
static int engine_step(const EngineModel *model, const RobotState *state, EngineRigid rigid,
                       const double *torque, const EngineGround *ground, double steepest) {
    EngineWork *work = &engine.work;
    const EngineTree *tree = &model->tree;
    engine_take(model, state, torque, 1);
    const int near = engine_floor_near(model, work, ground, steepest);
    engine_save(tree, 1, work, &engine.saved);
    engine_save_links(tree, work, &engine.links);
    memset(work, 0xff, sizeof *work);
    engine_restore(tree, 1, &engine.saved, work);
    engine_restore_links(tree, &engine.links, work);
    const EngineLinks links = engine_links_of(work);
    const FloorPose pose = {model, &links, work->base, ground, near};
    const int touches = engine_floor_touches(&pose);
    engine_collide_on(model, rigid, ground, work);
    engine_floor_collide(&pose, rigid, work, &engine.floor);
    assert_true(touches == (engine.floor.points > 0));
    engine_floor_solve(model, &engine.floor, work);
    assert_int_equal(engine_integrate(model, work), 0);
    return touches;
}

static void compare_rigid(const EngineModel *model, const RobotSim *sim, Rigid *worst) {
    const EngineWork *work = &engine.work;
    const double weight = 9.81 * sim->robot->total_mass;
    double load = 0;
    worst->rate = worse(worst->rate, rates_apart(model, sim));
    for (int f = 0; f < model->tree.feet; f++) {
        for (int k = 0; k < 3; k++) {
            const double gap = work->wrench[f][k] - sim->contact.foot[f].force[k];
            worst->wrench = worse(worst->wrench, fabs(gap) / weight);
        }
    }
    for (int i = 0; i < engine.floor.count; i++) {
        load += engine.floor.wrench[i][2];
    }
    worst->load = worse(worst->load, fabs(load - robot_sim_shell_load(sim)) / weight);
    worst->steps++;
    worst->points += engine.floor.points;
    worst->bodies += sim->rows - sim->robot->def.feet;
    worst->limited += (int)work->held[0] & 1; /* a joint is beyond its limit */
    worst->newton = work->newton > worst->newton ? work->newton : worst->newton;
}

static void fall_rigid(const Both *both, const MildMap *map, uint32_t number, Rigid *worst) {
    RobotSim *sim = both->sim;
    Random random = random_at(5, number, 0);
    MildTerrain terrain = kit_terrain("rubber");
    const MapView view = map ? map_view(map) : (MapView){0};
    const double origin[2] = {0, 0};
    const EngineGround ground = {map ? &view : NULL, origin, 0};
    RobotVariation rigid = robot_variation_nominal();
    RobotState state = random_state(both->robot, &random);
    terrain.map = map;
    rigid.rigid = 1;
    rigid.rigid_friction = random_uniform(&random, 0.2, 1.2);
    rigid.rigid_time = number % 3 ? 0 : random_uniform(&random, 0.02, 0.1);
    const EngineRigid of = {rigid.rigid_friction, rigid.rigid_time};
    robot_sim_load(sim, &state, &rigid);
    for (int s = 0; s < FALL_STEPS; s++) {
        double torque[ROBOT_JOINTS_MAX];
        random_torque(both->robot, &random, torque);
        robot_sim_store(sim, &state);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, NULL), 0);
        const int touches =
            engine_step(both->model, &state, of, torque, &ground, map ? map->steepest : 0);
        worst->missed += touches != (sim->rows > both->robot->def.feet);
        worst->idle += !touches;
        if (touches) {
            compare_rigid(both->model, sim, worst);
        }
    }
}

TEST(falls_are_those_of_mujoco) {
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    MildMap *map = mild_map_create(&waves, NULL);
    assert_non_null(map);
    for (int r = 0; r < ROBOTS; r++) {
        Both both = open_both(names[r]);
        Rigid worst = {0};
        for (uint32_t n = 0; n < RIGID_FALLS; n++) {
            fall_rigid(&both, n % 2 ? map : NULL, n, &worst);
        }
        print_message("%s: %d steps with %.1f points of %.1f bodies down, %d without, %d at "
                      "limits, at most %d Newton steps; worst next velocity %.1e, wrench %.1e, "
                      "load of the shells %.1e\n",
                      names[r], worst.steps, (double)worst.points / worst.steps,
                      (double)worst.bodies / worst.steps, worst.idle, worst.limited, worst.newton,
                      worst.rate, worst.wrench, worst.load);
        assert_true(worst.steps > 2000 && worst.points > worst.steps && worst.idle > 500);
        assert_true(worst.missed == 0 && worst.limited > 100);
        assert_true(worst.rate < 1e-10 && worst.wrench < 1e-10 && worst.load < 1e-10);
        close_both(&both);
    }
    mild_map_destroy(map);
}

TEST_MAIN(NULL, NULL)
