/* Shells on rigid ground, in the engine and by MuJoCo's solver: robots fall with shells that stand,
 * on level ground and on waves, and in each step with a shell down the engine begins where MuJoCo's
 * robot is. Its next velocity, the feet's wrenches and the load on the shells are the same. In
 * double. */
#include <stdio.h>

#include "falls.h"

#include "ground/terrain/grid.h"

enum { FALLS = 24 };

typedef struct {
    EngineWork work;
    EngineSaved saved;
    EngineSavedLinks links;
    EngineFloor floor;
} Engine;

typedef struct {
    double rate, wrench, load;
    int steps, points, bodies, limited, newton, missed, idle;
} Worst;

static Engine engine;

/* A step of the engine from MuJoCo's state. Returns whether a shell touches. */
static int engine_step(const EngineModel *model, const RobotState *state,
                       const RobotVariation *variation, const double *torque,
                       const EngineGround *ground, double steepest) {
    EngineWork *work = &engine.work;
    const EngineTree *tree = &model->tree;
    EngineVariation varied = {.armature_scale = 1};
    for (int i = 0; i < ENGINE_LINKS_MAX; i++) {
        varied.link_mass_scale[i] = 1;
    }
    const EngineRigid rigid = {variation->rigid_friction, variation->rigid_time};
    const EngineAction action = {&varied, torque, NULL, 1};
    memset(&engine, 0xff, sizeof engine);
    engine_load(model, state->qpos, state->qvel, work);
    for (int d = 0; d < 6 + tree->joints; d++) {
        work->acceleration[d] = state->qacc[d < 6 ? d : 6 + tree->joint[d - 5]];
    }
    engine_begin(model, &action, work);
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

static void compare(const EngineModel *model, const RobotSim *sim, Worst *worst) {
    const EngineWork *work = &engine.work;
    const double weight = 9.81 * sim->robot->total_mass;
    double size = 1e-3, load = 0;
    for (int d = 0; d < 6 + model->tree.joints; d++) {
        const double rate = robot_sim_qvel(sim)[d < 6 ? d : 6 + model->tree.joint[d - 5]];
        size = fmax(size, fabs(rate));
        worst->rate = worse(worst->rate, fabs(work->rate[d] - rate) / size);
    }
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

static void fall(const Robot *robot, const EngineModel *model, RobotSim *sim, const MildMap *map,
                 uint32_t number, Worst *worst) {
    Random random = random_at(5, number, 0);
    MildTerrain terrain = kit_terrain("rubber");
    const MapView view = map ? map_view(map) : (MapView){0};
    const double origin[2] = {0, 0};
    const EngineGround ground = {map ? &view : NULL, origin, 0};
    RobotVariation rigid = robot_variation_nominal();
    RobotState state = random_state(robot, &random);
    terrain.map = map;
    rigid.rigid = 1;
    rigid.rigid_friction = random_uniform(&random, 0.2, 1.2);
    rigid.rigid_time = number % 3 ? 0 : random_uniform(&random, 0.02, 0.1);
    robot_sim_load(sim, &state, &rigid);
    for (int s = 0; s < FALL_STEPS; s++) {
        double torque[ROBOT_JOINTS_MAX];
        random_torque(robot, &random, torque);
        robot_sim_store(sim, &state);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, NULL), 0);
        const int touches =
            engine_step(model, &state, &rigid, torque, &ground, map ? map->steepest : 0);
        worst->missed += touches != (sim->rows > robot->def.feet);
        worst->idle += !touches;
        if (touches) {
            compare(model, sim, worst);
        }
    }
}

static MildMap *waves(void) {
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_WAVES;
    MildMap *map = mild_map_create(&def, NULL);
    assert_non_null(map);
    return map;
}

TEST(falls_are_those_of_mujoco) {
    MildMap *map = waves();
    for (int r = 0; r < ROBOTS; r++) {
        Robot *robot = kit_robot_named(names[r]);
        robot_set_shells(robot, 1);
        EngineModel *model = read_model(robot);
        RobotSim *sim = robot_sim_create(robot, dt, NULL);
        sim->model->opt.tolerance = 1e-15;
        Worst worst = {0};
        for (uint32_t n = 0; n < FALLS; n++) {
            fall(robot, model, sim, n % 2 ? map : NULL, n, &worst);
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
        robot_sim_destroy(sim);
        free(model);
        robot_destroy(robot);
    }
    mild_map_destroy(map);
}

TEST_MAIN(NULL, NULL)
