/* Shells that stand on soft ground: in the air they change no bit of a step, under load they carry
 * the robot, and the ground under all of its bodies only takes energy. Arguments: number of falls
 * of each robot (default 40) and the first seed (default 1). */
#include <stdio.h>

#include "base/random.h"
#include "kit.h"
#include "robot/robot.h"
#include "robot/sim.h"

enum { ROBOTS = 3, STAND_STEPS = 400, FALL_SECONDS = 1 };
static const char *const names[ROBOTS] = {"sa01", "go1", "g1"};
static Robot *robots[ROBOTS]; /* without contact between the legs */
static int falls = 40;
static uint32_t first = 1;

static int setup(void **unused) {
    (void)unused;
    for (int r = 0; r < ROBOTS; r++) {
        MildError error = {0};
        robots[r] = robot_open(names[r], &error);
        print_message("%s", error.text);
        assert_non_null(robots[r]);
        robots[r]->leg_pairs = 0;
    }
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    for (int r = 0; r < ROBOTS; r++) {
        robot_destroy(robots[r]);
    }
    return 0;
}

/* To be freed by the caller. */
static MildGround *new_ground(const Robot *robot) {
    const int bodies = robot_bodies(robot);
    void *block = calloc(1, mild_ground_bytes(robot_soles(robot), bodies));
    assert_non_null(block);
    return mild_ground_init(block, robot_soles(robot), bodies);
}

static MildTerrain preset_terrain(const char *name) {
    MildMaterial material;
    assert_true(mild_material_preset(name, &material));
    return mild_terrain_uniform(&material);
}

/* Torques that hold the default pose. */
static void hold_pose(const Robot *robot, const RobotSim *sim, double stiffness, double *torque) {
    const double *pose = robot_default_pose(robot), *effort = robot_effort(robot);
    for (int j = 0; j < robot_joints(robot); j++) {
        const double error = pose[j] - robot_sim_qpos(sim)[7 + j];
        torque[j] = stiffness * effort[j] * (error - 0.03 * robot_sim_qvel(sim)[6 + j]);
        torque[j] = fmax(fmin(torque[j], effort[j]), -effort[j]);
    }
}

/* ---- in the air ---- */

/* Positions after a second on the feet, shells far above the ground. */
static void stand_still(Robot *robot, int shells, double qpos[ROBOT_NQ_MAX], double *load) {
    robot_set_shells(robot, shells);
    assert_true(robot_bodies(robot) > robot_feet(robot) || !shells);
    RobotSim *sim = robot_sim_create(robot, 0.0025, NULL);
    MildGround *ground = new_ground(robot);
    MildTerrain terrain = preset_terrain("rubber");
    double torque[ROBOT_JOINTS_MAX];
    *load = 0;
    for (int s = 0; s < STAND_STEPS / 8; s++) {
        hold_pose(robot, sim, 4, torque);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        *load += robot_sim_shell_load(sim);
    }
    memcpy(qpos, robot_sim_qpos(sim), ROBOT_NQ_MAX * sizeof *qpos);
    free(ground);
    robot_sim_destroy(sim);
}

TEST(in_the_air_they_change_nothing) {
    for (int r = 0; r < ROBOTS; r++) {
        double without[ROBOT_NQ_MAX], with[ROBOT_NQ_MAX], load;
        stand_still(robots[r], 0, without, &load);
        stand_still(robots[r], 1, with, &load);
        assert_memory_equal(with, without, sizeof with);
        assert_true(load == 0);
    }
}

/* A concentric model has one element for a sole, and none for a shell. */
TEST(concentric_models_have_none) {
    robot_set_shells(robots[0], 1);
    robot_set_model(robots[0], MILD_MODEL_CON_CONE);
    assert_int_equal(robot_bodies(robots[0]), robot_feet(robots[0]));
    robot_set_model(robots[0], MILD_MODEL_MILD);
    assert_true(robot_bodies(robots[0]) > robot_feet(robots[0]));
}

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
        MildGround *ground = new_ground(robot);
        MildTerrain terrain = preset_terrain(grounds[n % 2]);
        const RobotVariation nominal = robot_variation_nominal();
        RobotState state;
        robot_sim_store(sim, &state);
        state.qpos[2] = 0.5;
        state.qpos[3] = sqrt(0.5); /* on its back, or on its side */
        state.qpos[4 + (n / 2 != 1)] = -sqrt(0.5);
        robot_sim_load(sim, &state, &nominal);
        double torque[ROBOT_JOINTS_MAX], shells = 0, feet = 0;
        for (int s = 0; s < 4 * STAND_STEPS; s++) {
            hold_pose(robot, sim, 2, torque);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
            if (s >= 3 * STAND_STEPS) {
                shells += robot_sim_shell_load(sim) / STAND_STEPS;
                for (int f = 0; f < robot_feet(robot); f++) {
                    feet += robot_sim_foot(sim, f)->force[2] / STAND_STEPS;
                }
            }
        }
        const double weight = 9.81 * robot_total_mass(robot);
        print_message("%s on %s: shells carry %.1f %%, feet %.1f %% of the weight, base %.2f m\n",
                      names[n / 2], grounds[n % 2], 100 * shells / weight, 100 * feet / weight,
                      robot_sim_qpos(sim)[2]);
        assert_true(fabs(shells + feet - weight) < 0.02 * weight && shells > 0.2 * weight);
        free(ground);
        robot_sim_destroy(sim);
    }
}

/* ---- energy ---- */

/* Anywhere within the joints' ranges, above the ground, in motion. */
static RobotState random_throw(const Robot *robot, RobotSim *sim, const MildTerrain *terrain,
                               Random *random) {
    const RobotVariation nominal = robot_variation_nominal();
    RobotState state = {.qpos = {0, 0, 2}};
    for (int k = 3; k < 7; k++) {
        state.qpos[k] = random_normal(random);
    }
    mju_normalize4(state.qpos + 3);
    for (int j = 0; j < robot->def.joints; j++) {
        state.qpos[7 + j] = random_uniform(random, robot->low[j], robot->high[j]);
    }
    for (int d = 0; d < robot->nv; d++) {
        state.qvel[d] = random_uniform(random, -2, 2);
    }
    robot_sim_load(sim, &state, &nominal);
    const double low =
        fmin(robot_sim_body_clearance(sim, terrain), robot_sim_sole_clearance(sim, terrain));
    state.qpos[2] += 0.02 - low;
    return state;
}

/* [J] Work of the ground on all bodies over the last step, at the mean of their twists before and
 * after it. most: the same, absolute. */
static double ground_work(const RobotSim *sim, double *size) {
    double sum = 0;
    for (int i = 0; i < sim->rows; i++) {
        const int b = sim->row[i];
        const MildFootResult *body = &sim->contact.foot[b];
        const double *before = sim->input.velocity[b], *after = sim->contact.velocity + 6 * b;
        for (int k = 0; k < 3; k++) {
            const double work = 0.5 * sim->dt *
                                (body->force[k] * (before[k] + after[k]) +
                                 body->torque[k] * (before[3 + k] + after[3 + k]));
            sum += work;
            *size += fabs(work);
        }
    }
    return sum;
}

/* Largest rise of the energy that the ground has given in a fall, over all that it moved; -1: the
 * robot turned by more than 0.1 rad in a step, or diverged. */
static double fall(Robot *robot, RobotSim *sim, MildGround *ground, const MildTerrain *terrain,
                   Random *random, int *most) {
    const RobotVariation nominal = robot_variation_nominal();
    const double torque[ROBOT_JOINTS_MAX] = {0};
    RobotState state = random_throw(robot, sim, terrain, random);
    double given = 0, size = 1e-9, worst = 0;
    robot_sim_load(sim, &state, &nominal);
    mild_ground_reset(ground);
    for (int s = 0; s < FALL_SECONDS / sim->dt; s++) {
        if (robot_sim_step(sim, torque, NULL, terrain, ground)) {
            return -1;
        }
        for (int i = 0; i < sim->rows; i++) {
            if (mju_norm3(sim->contact.velocity + 6 * sim->row[i] + 3) * sim->dt > 0.1) {
                return -1;
            }
        }
        given += ground_work(sim, &size);
        worst = fmax(worst, given);
        *most = sim->rows > *most ? sim->rows : *most;
    }
    return worst / size;
}

TEST(falls_take_energy) {
    static const char *const grounds[] = {"foam45", "sand_loose", "rubber", "foam25"};
    for (int r = 0; r < ROBOTS; r++) {
        Robot *robot = robots[r];
        double low[ROBOT_JOINTS_MAX], high[ROBOT_JOINTS_MAX];
        memcpy(low, robot->low, sizeof low);
        memcpy(high, robot->high, sizeof high);
        robot_set_shells(robot, 1);
        RobotSim *sim = robot_sim_create(robot, 0.001, NULL);
        MildGround *ground = new_ground(robot);
        double worst = 0;
        int left = 0, gained = 0, most = 0;
        for (int n = 0; n < falls; n++) {
            Random random = random_at(first, (uint32_t)(falls * r + n), 0);
            const MildTerrain terrain = preset_terrain(grounds[n % 4]);
            const double gain = fall(robot, sim, ground, &terrain, &random, &most);
            left += gain < 0;
            gained += gain > 1e-9;
            worst = fmax(worst, gain);
        }
        print_message("%s: %d of %d falls give energy, %.1e of what was moved at most; %d left "
                      "out; up to %d bodies near the ground\n",
                      names[r], gained, falls, worst, left, most);
        assert_true(gained == 0 && left <= falls / 20 && most > robot_feet(robot) + 1);
        free(ground);
        robot_sim_destroy(sim);
    }
}

int main(int argc, char **argv) {
    falls = argc > 1 ? atoi(argv[1]) : kit_short() ? 1 + falls / 5 : falls;
    first = argc > 2 ? (uint32_t)atoi(argv[2]) : first;
    return run_cases(setup, teardown);
}
