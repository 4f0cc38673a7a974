/* Every entry of the observation, the estimates and the critic's input at states in motion, one by
 * one, against the engine's own functions or a hand's; noise; history. */
#include "sa01.h"
#include "task_oracle.h"

#define TOLERANCE 2e-6 /* [-] of a float of about 10 */

static const double flat_scale[3] = {2, 2, 1}; /* of the command */

/* Readings that differ from the truth, so that one sees who looks at which. */
static TaskSensors other_reading(void) {
    TaskSensors reading;
    for (int i = 0; i < 3; i++) {
        reading.omega[i] = 0.5 + i;
        reading.gravity[i] = 0.1 - 0.3 * i;
    }
    for (int i = 0; i < SA01_JOINTS; i++) {
        reading.q[i] = 0.03 * i - 0.2;
        reading.qd[i] = 2 - 0.5 * i;
    }
    return reading;
}

/* The numbers of an episode, all of them different. */
static void fill_env(TaskEnv *env) {
    const double command[3] = {0.7, -0.2, 0.4}, seen[3] = {0.55, 0.25, -1.1};
    memcpy(env->command, command, sizeof command);
    memcpy(env->command_seen, seen, sizeof seen);
    env->phase = 0.3;
    for (int i = 0; i < SA01_JOINTS; i++) {
        env->action[0][i] = 0.25f * (float)(i - 5);
        env->action[1][i] = 9;
    }
    for (int i = 0; i < 6; i++) {
        env->push[i] = 0.01 * (i + 1);
    }
    env->variation.base_mass_add = 1.5;
    env->variation.armature_scale = 1.2;
    env->variation.rigid_friction = 0.45;
    for (int i = 0; i < 3; i++) {
        env->variation.com_offset[i] = 0.002 * (i + 1);
        env->smooth_velocity[i] = 0.4 - 0.3 * i;
    }
    env->strength = 0.93;
    env->lag_command = 1;
    env->lag_motor = 2;
    env->lag_imu = 3;
    env->assist_level = 0.5;
    env->assist_draw = 0.8;
}

static void look(const TaskSensors *reading) {
    task_env_observe(rig.env, &rig.def, robot, rig.sim, reading, 0, &rig.view);
}

static void expect_frame(const char *what, const float *frame, const double omega[3],
                         const double gravity[3], const double *q, const double *qd,
                         const double clock[2]) {
    const double *pose = robot_default_pose(robot);
    for (int i = 0; i < 3; i++) {
        expect_entry(what, i, (double)frame[i], omega[i], TOLERANCE);
        expect_entry(what, 3 + i, (double)frame[3 + i], flat_scale[i] * rig.env->command_seen[i],
                     TOLERANCE);
        expect_entry(what, 6 + i, (double)frame[6 + i], gravity[i], TOLERANCE);
    }
    for (int i = 0; i < SA01_JOINTS; i++) {
        expect_entry(what, 9 + i, (double)frame[9 + i], q[i] - pose[i], TOLERANCE);
        expect_entry(what, 21 + i, (double)frame[21 + i], qd[i] / 20, TOLERANCE);
        expect_entry(what, 33 + i, (double)frame[33 + i], 0.25 * (i - 5), 0);
    }
    expect_entry(what, 45, (double)frame[45], clock[0], TOLERANCE);
    expect_entry(what, 46, (double)frame[46], clock[1], TOLERANCE);
}

/* sin, cos of 108 degrees at phase 0.3. */
static const double clock_at_03[2] = {0.9510565163, -0.3090169944}, no_clock[2] = {0, 0};

/* The actor sees the readings, the critic the truth. */
TEST_WITH(frame, open_quiet, close_rig) {
    TaskSensors reading = other_reading();
    for (uint32_t draw = 0; draw < 10; draw++) {
        Oracle o = rig_place(&rig, draw);
        fill_env(rig.env);
        look(&reading);
        expect_frame("frame", rig.frame, reading.omega, reading.gravity, reading.q, reading.qd,
                     clock_at_03);
        expect_frame("critic", rig.critic, o.omega, o.gravity, rig.env->robot.qpos + 7,
                     rig.env->robot.qvel + 6, clock_at_03);
    }
}

/* Off by key, and (0, 0) while the command that the policy sees stands. */
TEST_WITH(the_clock, open_quiet, close_rig) {
    TaskSensors reading = other_reading();
    Oracle o = rig_place(&rig, 1);
    fill_env(rig.env);
    memset(rig.env->command, 0, sizeof rig.env->command); /* not seen yet */
    look(&reading);
    expect_frame("standing unseen", rig.critic, o.omega, o.gravity, rig.env->robot.qpos + 7,
                 rig.env->robot.qvel + 6, clock_at_03);
    fill_env(rig.env);
    memset(rig.env->command_seen, 0, sizeof rig.env->command_seen);
    look(&reading);
    expect_frame("standing", rig.frame, reading.omega, reading.gravity, reading.q, reading.qd,
                 no_clock);
    fill_env(rig.env);
    rig.def.clock = 0;
    look(&reading);
    expect_frame("no clock", rig.frame, reading.omega, reading.gravity, reading.q, reading.qd,
                 no_clock);
    expect_frame("no clock", rig.critic, o.omega, o.gravity, rig.env->robot.qpos + 7,
                 rig.env->robot.qvel + 6, no_clock);
}

/* Base velocity times 4, sole velocities, heights above the ground times 10; or as the keys say. */
TEST_WITH(estimates, open_quiet, close_rig) {
    TaskSensors reading = other_reading();
    double velocity_scale = 4, height_scale = 10;
    for (uint32_t draw = 0; draw < 10; draw++) {
        if (draw == 5) {
            rig.def.velocity_scale = velocity_scale = 1;
            rig.def.height_scale = height_scale = 2;
        }
        Oracle o = rig_place(&rig, draw);
        look(&reading);
        double wanted[SA01_ESTIMATES];
        for (int i = 0; i < 3; i++) {
            wanted[i] = velocity_scale * o.velocity[i];
        }
        for (int f = 0; f < SA01_FEET; f++) {
            oracle_to_base(&o, o.sole_velocity[f], wanted + 3 + 3 * f);
            wanted[9 + f] = height_scale * (o.sole_lowest[f] - 0.05);
        }
        for (int i = 0; i < SA01_ESTIMATES; i++) {
            expect_entry("estimate", i, (double)rig.estimate[i], wanted[i], 5 * TOLERANCE);
            expect_entry("critic's estimate", i, (double)rig.critic[47 + i], wanted[i],
                         5 * TOLERANCE);
        }
    }
}

/* Force in the base frame over 300 N, within +-5; contact; scheduled stance; mean depth times 10.
 */
TEST_WITH(feet_of_the_critic, open_quiet, close_rig) {
    TaskSensors reading = other_reading();
    for (uint32_t draw = 0; draw < 10; draw++) {
        Oracle o = rig_place(&rig, draw);
        fill_env(rig.env);
        const double force[SA01_FEET][3] = {{60, -90, 240}, {30, 15, -60}};
        for (int f = 0; f < SA01_FEET; f++) {
            RobotFoot *foot = oracle_set_force(rig.sim, f, force[f][0], force[f][1], force[f][2]);
            foot->result.depth_mean = 0.03 + 0.01 * f;
        }
        look(&reading);
        for (int f = 0; f < SA01_FEET; f++) {
            double base[3];
            const float *seen = rig.critic + 58 + 6 * f;
            oracle_to_base(&o, force[f], base);
            for (int i = 0; i < 3; i++) {
                expect_entry("force", 3 * f + i, (double)seen[i], base[i] / 300, TOLERANCE);
            }
            expect_entry("contact", f, (double)seen[3], f == 0, 0);
            expect_entry("stance", f, (double)seen[4], f == 0, 0); /* phase 0.3 */
            expect_entry("depth", f, (double)seen[5], 0.3 + 0.1 * f, TOLERANCE);
        }
    }
}

TEST_WITH(limits_of_the_critic, open_quiet, close_rig) {
    RobotState state = kit_state(1.2);
    kit_load(rig.sim, &state, rig.env);
    TaskSensors reading = other_reading();
    fill_env(rig.env);
    rig.env->phase = 0.7;
    oracle_set_force(rig.sim, 0, 1600, -1600, 4.99);
    oracle_set_force(rig.sim, 1, 1490, -1490, 5.01);
    look(&reading);
    const double wanted[2][5] = {{5, -5, 4.99 / 300, 0, 0},
                                 {14.9 / 3, -14.9 / 3, 5.01 / 300, 1, 1}};
    for (int f = 0; f < SA01_FEET; f++) {
        for (int i = 0; i < 5; i++) {
            expect_entry("foot", 5 * f + i, (double)rig.critic[58 + 6 * f + i], wanted[f][i],
                         TOLERANCE);
        }
    }
    memset(rig.env->command, 0, sizeof rig.env->command);
    look(&reading);
    assert_true(rig.critic[62] == 1 && rig.critic[68] == 1); /* standing: both scheduled down */
}

/* Two materials, each of its numbers different; the second lies where the base is. */
static MildTerrain two_materials(double x, double y) {
    MildMaterial first = mild_material_default(), second = first;
    second.k_pen = 700;
    second.sigma_cone = 0.12e6;
    second.alpha = 1.0;
    second.nu = 1.7;
    second.c_g = 2.4;
    second.c_d = 10;
    second.phi = 0.55;
    second.mu = 0.9;
    second.k_drift = 1000;
    second.b_drift = 0.03;
    second.recovery = 0.25;
    second.bed_depth = 0.12;
    MildTerrain terrain = mild_terrain_uniform(&first);
    terrain.materials[terrain.material_count++] = second;
    MildPatch patch = {x - 0.05, x + 0.05, y - 0.05, y + 0.05, 1};
    assert_int_equal(mild_terrain_add_patch(&terrain, &patch, NULL), MILD_OK);
    terrain.height = 0.05;
    return terrain;
}

TEST_WITH(episode_of_the_critic, open_quiet, close_rig) {
    TaskSensors reading = other_reading();
    rig_place(&rig, 12);
    fill_env(rig.env);
    const double *qpos = robot_sim_qpos(rig.sim);
    task_env_rest(rig.env)->terrain = two_materials(qpos[0], qpos[1]);
    rig.def.assist = 1;
    const double ground[12] = {1.4, 1.2, 1.0, 1.7, 0.6, 0.5, 0.55, 0.9, 2.0, 0.3, 0.25, 1.2};
    for (int rigid = 0; rigid < 2; rigid++) {
        rig.env->variation.rigid = rigid;
        look(&reading);
        for (int i = 0; i < 6; i++) {
            expect_entry("push", i, (double)rig.critic[70 + i], 0.01 * (i + 1), TOLERANCE);
        }
        expect_near("added mass", (double)rig.critic[76], 0.375, TOLERANCE);
        for (int i = 0; i < 3; i++) {
            expect_entry("centre of mass", i, (double)rig.critic[77 + i], 0.2 * (i + 1), TOLERANCE);
        }
        for (int i = 0; i < 12; i++) {
            expect_entry("ground", i, (double)rig.critic[80 + i], rigid ? 0 : ground[i], TOLERANCE);
        }
        const double last[12] = {rigid, 1.15, 0.93, 1.2, 0.25, 0.5,
                                 0.75,  0.45, 0.4,  0.4, 0.1,  -0.2};
        for (int i = 0; i < 12; i++) {
            expect_entry("critic", 92 + i, (double)rig.critic[92 + i], last[i], TOLERANCE);
        }
    }
    assert_int_equal(task_critic_ground(&rig.env->shape), 80);
    rig.def.assist = 0;
    look(&reading);
    expect_near("nobody helps", (double)rig.critic[100], 0, 0);
}

/* The one element of a concentric sole is shown as one of the raster's 77 cells. */
TEST(concentric_ground) {
    robot_set_model(robot, MILD_MODEL_CON_CONE);
    rig_open_quiet(&rig, 0.5);
    TaskSensors reading = other_reading();
    rig_place(&rig, 12);
    const double *qpos = robot_sim_qpos(rig.sim);
    task_env_rest(rig.env)->terrain = two_materials(qpos[0], qpos[1]);
    MildMaterial *m = &task_env_rest(rig.env)->terrain.materials[1];
    m->model = MILD_MODEL_CON_CONE;
    m->k_pen *= 77;
    m->k_drift *= 77;
    m->b_drift *= 77;
    look(&reading);
    expect_near("k_pen", (double)rig.critic[80], 1.4, TOLERANCE);
    expect_near("k_drift", (double)rig.critic[88], 2.0, TOLERANCE);
    expect_near("b_drift", (double)rig.critic[89], 0.3, TOLERANCE);
    m->k_pen = m->sigma_cone = 5e6; /* a floor */
    look(&reading);
    assert_true(rig.critic[80] == 4 && rig.critic[81] == 4);
    rig_close(&rig);
    robot_set_model(robot, MILD_MODEL_MILD);
}

/* After a step on the ground: the forces and the depth are those of the step's contact. */
TEST_WITH(contact_reaches_the_critic, open_quiet, close_rig) {
    for (int t = 0; t < 20; t++) {
        rig_step(&rig, NULL);
    }
    Oracle o = oracle_of(rig.sim);
    const MildContactResult *contact = robot_sim_contact(rig.sim);
    for (int f = 0; f < SA01_FEET; f++) {
        double base[3];
        oracle_to_base(&o, contact->foot[f].force, base);
        assert_true(base[2] > 50);
        for (int i = 0; i < 3; i++) {
            expect_entry("force", 3 * f + i, (double)rig.critic[58 + 6 * f + i], base[i] / 300,
                         TOLERANCE);
        }
        expect_entry("depth", f, (double)rig.critic[63 + 6 * f], 10 * contact->foot[f].depth_mean,
                     TOLERANCE);
        expect_entry("height", f, (double)rig.estimate[9 + f], 10 * o.sole_lowest[f], TOLERANCE);
        assert_true(rig.estimate[9 + f] < 0);
    }
    assert_memory_equal(rig.frame, rig.critic,
                        SA01_OBSERVATION * sizeof *rig.frame); /* neither noise nor latency */
}

/* ---- noise ---- */

static double noise_limit(int i) {
    return i < 3 ? 0.3 : i < 6 ? 0 : i < 9 ? 0.075 : i < 21 ? 0.03 : i < 33 ? 0.19 : 0;
}

/* Uniform: both ends nearly reached, mean 0, variance limit^2/3, no entry follows another. */
TEST_WITH(noise, open_quiet, close_rig) {
    enum { DRAWS = 20000 };
    TaskSensors reading = other_reading();
    rig_place(&rig, 13);
    fill_env(rig.env);
    look(&reading);
    float quiet[SA01_OBSERVATION];
    memcpy(quiet, rig.frame, sizeof quiet);
    rig.def.observe_noise = 1;
    static double low[SA01_OBSERVATION], high[SA01_OBSERVATION], sum[SA01_OBSERVATION],
        square[SA01_OBSERVATION], product[SA01_OBSERVATION][SA01_OBSERVATION];
    EnvsView view = {.frame = rig.frame};
    for (int t = 0; t < DRAWS; t++) {
        rig.env->tick = (uint32_t)t;
        task_env_observe(rig.env, &rig.def, robot, rig.sim, &reading, 0, &view);
        for (int i = 0; i < SA01_OBSERVATION; i++) {
            double x = (double)(rig.frame[i] - quiet[i]);
            low[i] = fmin(low[i], x);
            high[i] = fmax(high[i], x);
            sum[i] += x;
            square[i] += x * x;
            for (int j = 0; j < i && t % 4 == 0; j++) {
                product[i][j] += x * (double)(rig.frame[j] - quiet[j]);
            }
        }
    }
    double worst = 0;
    for (int i = 0; i < SA01_OBSERVATION; i++) {
        double a = noise_limit(i), sigma = a / sqrt(3);
        expect_entry("lowest noise", i, low[i], -a, 0.002 * a + 1e-12);
        expect_entry("greatest noise", i, high[i], a, 0.002 * a + 1e-12);
        expect_entry("mean noise", i, sum[i] / DRAWS, 0, 4.5 * sigma / sqrt(DRAWS));
        expect_entry("variance of the noise", i, square[i] / DRAWS, sigma * sigma,
                     0.03 * sigma * sigma);
        for (int j = 0; j < i && a > 0; j++) {
            double b = noise_limit(j);
            if (b > 0) {
                double correlation = product[i][j] / (DRAWS / 4) / (sigma * b / sqrt(3));
                worst = fmax(worst, fabs(correlation));
            }
        }
    }
    expect_near("noise: largest correlation of two entries", worst, 0,
                0.07); /* 5 sigma of 5000 draws */
    look(&reading);    /* the critic sees none of it */
    Oracle o = oracle_of(rig.sim);
    expect_frame("critic", rig.critic, o.omega, o.gravity, rig.env->robot.qpos + 7,
                 rig.env->robot.qvel + 6, clock_at_03);
}

/* ---- history ---- */

/* Frame t has t in its first entry: the history's means are then means of counts. */
static void expect_history(int stride, int frames) {
    for (int i = 0; i < TASK_FRAMES; i++) {
        double mean = 0;
        int oldest = (TASK_FRAMES - 1 - i) * stride;
        for (int k = 0; k < stride && oldest > 0; k++) {
            mean += fmax(frames - 1 - (oldest - k), 0) / stride;
        }
        mean = oldest > 0 ? mean : frames - 1;
        expect_entry("history", i, (double)rig.history[i * SA01_OBSERVATION], mean, 1e-4);
        expect_entry("history's last entry", i, (double)rig.history[(i + 1) * SA01_OBSERVATION - 1],
                     (double)rig.frame[46], 1e-6);
    }
}

/* More frames than the largest ring of 81 holds, twice over. */
TEST(history) {
    const int strides[] = {1, 3, 8, 16};
    for (int s = 0; s < 4; s++) {
        TaskDef def = kit_quiet_def();
        def.history_stride = strides[s];
        rig_open(&rig, &def, 3, 0);
        rig_start(&rig, 0.5, 0, 0);
        TaskSensors reading = other_reading();
        for (int t = 0; t < 200; t++) {
            reading.omega[0] = t;
            task_env_observe(rig.env, &rig.def, robot, rig.sim, &reading, t == 0, &rig.view);
            expect_history(strides[s], t + 1);
        }
        assert_memory_equal(rig.history, task_env_history(rig.env),
                            SA01_HISTORY * sizeof *rig.history);
        reading.omega[0] = -5; /* the next episode knows nothing of this one */
        task_env_observe(rig.env, &rig.def, robot, rig.sim, &reading, 1, &rig.view);
        for (int i = 0; i < TASK_FRAMES; i++) {
            expect_entry("new history", i, (double)rig.history[i * SA01_OBSERVATION], -5, 1e-5);
        }
        rig_close(&rig);
    }
}

TEST_MAIN(kit_setup, kit_teardown)
