/* Legs: their mirror image and their swing, as robot.ini has them; contact between them, its
 * distance against MuJoCo's of the same geoms, and that it only takes energy. */
#include "all_robots.h"
#include "robot/legs.h"

enum { POSES = 3000, THROWS = 200, THROW_STEPS = 80 };
static Robot *legged[ROBOTS]; /* the same robots, whose legs touch */

static int setup(void **unused) {
    for (int r = 0; r < ROBOTS; r++) {
        legged[r] = kit_robot_named(names[r]);
        assert_true(legged[r]->leg_pairs > 0);
    }
    return open_robots(unused);
}

static int teardown(void **unused) {
    for (int r = 0; r < ROBOTS; r++) {
        robot_destroy(legged[r]);
    }
    return close_robots(unused);
}

/* Mirrored angles put the mirrored foot at the mirrored place. */
TEST(mirrored_legs) {
    const RobotVariation nominal = robot_variation_nominal();
    for (int r = 0; r < ROBOTS; r++) {
        const Robot *robot = robots[r];
        RobotSim *sim = robot_sim_create(robot, 0.001, NULL);
        Random random = random_at(3, (uint32_t)r, 0);
        for (int draw = 0; draw < 20; draw++) {
            RobotState state = random_pose(robot, 1, &random), image;
            double center[ROBOT_FEET_MAX][3];
            memcpy(state.qpos + 3, (const double[4]){1}, 4 * sizeof(double));
            image = state;
            for (int i = 0; i < robot_joints(robot); i++) {
                image.qpos[7 + robot_mirror_joint(robot)[i]] =
                    robot_mirror_sign(robot)[i] * state.qpos[7 + i];
            }
            robot_sim_load(sim, &state, &nominal);
            for (int f = 0; f < robot_feet(robot); f++) {
                memcpy(center[f], robot_sim_foot(sim, f)->sole_center, sizeof center[f]);
            }
            robot_sim_load(sim, &image, &nominal);
            for (int f = 0; f < robot_feet(robot); f++) {
                const double *other = robot_sim_foot(sim, f ^ 1)->sole_center;
                for (int k = 0; k < 3; k++) {
                    expect_near(names[r], center[f][k], (k == 1 ? -1 : 1) * other[k], 1e-9);
                }
            }
        }
        robot_sim_destroy(sim);
    }
}

/* The swing shortens every leg: the feet rise by more than 1 cm. */
TEST(swinging_legs) {
    const RobotVariation nominal = robot_variation_nominal();
    for (int r = 0; r < ROBOTS; r++) {
        RobotSim *sim = robot_sim_create(robots[r], 0.001, NULL);
        RobotState state;
        robot_sim_store(sim, &state);
        for (int i = 0; i < robot_joints(robots[r]); i++) {
            state.qpos[7 + i] += 0.4 * robot_swing(robots[r])[i];
        }
        robot_sim_load(sim, &state, &nominal);
        for (int f = 0; f < robot_feet(robots[r]); f++) {
            assert_true(robot_sim_foot(sim, f)->sole_height > 0.01);
        }
        robot_sim_destroy(sim);
    }
}

/* ---- distance ---- */

/* [m] Of the geoms by MuJoCo; which leg a geom is of by the foot whose name it begins with, but for
 * SA01's leg_l and leg_r. */
static double geom_distance(const Robot *robot, const RobotState *state, mjData *d) {
    const mjModel *m = robot->visual;
    const int letters = robot->def.name[0] == 's' ? 5 : 2;
    double least = 1e9;
    robot_engine_qpos(robot, state->qpos, d->qpos);
    mj_kinematics(m, d);
    for (int a = 0; a < robot->def.legs; a++) {
        for (int b = 0; b < a; b++) {
            const char *one = robot->def.leg[a], *other = robot->def.leg[b];
            if (strncmp(one, other, (size_t)letters) != 0) {
                const int geom[2] = {mj_name2id(m, mjOBJ_GEOM, one),
                                     mj_name2id(m, mjOBJ_GEOM, other)};
                least = fmin(least, mj_geomDistance(m, d, geom[0], geom[1], 5, NULL));
            }
        }
    }
    return least;
}

TEST(distance_is_mujocos) {
    const RobotVariation nominal = robot_variation_nominal();
    for (int r = 0; r < ROBOTS; r++) {
        mjData *d = mj_makeData(legged[r]->visual);
        RobotSim *sim = robot_sim_create(legged[r], 0.0025, NULL);
        Random random = random_at(61, (uint32_t)r, 0);
        int overlaps = 0;
        for (int n = 0; n < POSES; n++) {
            const RobotState state = random_pose(legged[r], 2, &random);
            robot_sim_load(sim, &state, &nominal);
            const double own = robot_sim_leg_distance(sim);
            const double distance = geom_distance(legged[r], &state, d);
            expect_near(names[r], own, distance, 2e-5);
            overlaps += distance < 0;
        }
        assert_true(overlaps > POSES / 100 && overlaps < POSES);
        robot_sim_destroy(sim);
        mj_deleteData(d);
    }
}

/* ---- energy ---- */

/* [J] Kinetic, with M of the beginning of the last step. */
static double kinetic(RobotSim *sim) {
    const int nv = sim->robot->nv;
    double momentum[ROBOT_NV_MAX];
    mj_mulM(sim->model, sim->data, momentum, sim->data->qvel);
    return 0.5 * mju_dot(momentum, sim->data->qvel, nv);
}

/* A pose whose legs are apart, thrown so that they meet: joints' speeds at random. */
static RobotState random_throw(const Robot *robot, RobotSim *sim, Random *random) {
    const RobotVariation nominal = robot_variation_nominal();
    RobotState state;
    do {
        state = random_pose(robot, 2, random);
        for (int d = 0; d < robot->nv; d++) {
            state.qvel[d] = random_uniform(random, -4, 4);
        }
        robot_sim_load(sim, &state, &nominal);
    } while (robot_sim_leg_distance(sim) < 0.005 || robot_sim_leg_distance(sim) > 0.1);
    return state;
}

/* Of a throw: [J] the contact's work, as what it changes in each step. Returns bool: legs met.
 * deepest [m]: least distance. */
static int throw_legs(RobotSim *with, RobotSim *bare, RobotState state, MildGround *ground,
                      double *work, double *deepest) {
    const RobotVariation nominal = robot_variation_nominal();
    const double torque[ROBOT_JOINTS_MAX] = {0};
    const MildMaterial any = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&any);
    int met = 0;
    terrain.height = -100;
    *work = 0;
    *deepest = 1;
    for (int k = 0; k < THROW_STEPS; k++) {
        robot_sim_load(with, &state, &nominal);
        robot_sim_load(bare, &state, &nominal);
        if (robot_sim_step(with, torque, NULL, &terrain, ground) ||
            robot_sim_step(bare, torque, NULL, &terrain, ground)) {
            return 0; /* an end of its own: limits throw light joints */
        }
        const double change = kinetic(with) - kinetic(bare);
        met |= change != 0;
        *work += change;
        *deepest = fmin(*deepest, robot_sim_leg_distance(with));
        robot_sim_store(with, &state);
    }
    return met;
}

TEST(contact_takes_energy) {
    static const double steps[] = {0.001, 0.0025, 0.005};
    for (int r = 0; r < ROBOTS; r++) {
        for (int s = 0; s < 3; s++) {
            MildError error = {0};
            RobotSim *with = robot_sim_create(legged[r], steps[s], &error);
            RobotSim *bare = robot_sim_create(robots[r], steps[s], &error);
            Random random = random_at(62, (uint32_t)(3 * r + s), 0);
            MildGround *ground = kit_ground(legged[r]);
            double most = -1e9, least = 0, deepest = 1;
            int met = 0;
            mju_zero3(with->model->opt.gravity);
            mju_zero3(bare->model->opt.gravity);
            for (int n = 0; n < THROWS; n++) {
                double work, distance;
                const RobotState state = random_throw(legged[r], with, &random);
                if (throw_legs(with, bare, state, ground, &work, &distance)) {
                    most = fmax(most, work);
                    least = fmin(least, work);
                    deepest = fmin(deepest, distance);
                    met++;
                }
            }
            printf("%s, %g ms: %d of %d throws meet, work %.2g to %.2g J, deepest %.1f mm\n",
                   names[r], 1e3 * steps[s], met, THROWS, least, most, -1e3 * deepest);
            assert_true(met > THROWS / 20 && most < 1e-9 && least < -0.01);
            free(ground);
            robot_sim_destroy(with);
            robot_sim_destroy(bare);
        }
    }
}

/* ---- the law by hand ---- */

/* 2 kg on 1/A: approaching at 0.4 m/s from 0.5 mm in 2.5 ms, 0.2 m/s are too fast. In overlap of
 * 1 mm at rest half of it is taken back in a step, at 0.2 m/s. */
TEST(force_by_hand) {
    expect_near("force", legs_force(0.0025, 0.0005, -0.4, 0.5), 0.2 / (0.0025 * 0.5), 1e-9);
    expect_near("force", legs_force(0.0025, -0.001, 0, 0.5), 0.2 / (0.0025 * 0.5), 1e-9);
    assert_true(legs_force(0.0025, 0.0005, -0.199, 0.5) == 0);
    assert_true(legs_force(0.0025, -0.001, 0.201, 0.5) == 0);
}

TEST_MAIN(setup, teardown)
