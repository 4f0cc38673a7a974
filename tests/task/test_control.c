/* From the policy's action to the joints' torque, and back to what it reads: clip, scale, gains,
 * strength, offsets, limits, the three latencies, the command's delay, the clock, the helping hand.
 */
#include "sa01.h"
#include "task_oracle.h"

#define STEPS_MAX 20

/* What each physics step of a policy period saw. Entry 0 is the state before the first one. */
typedef struct {
    int count;
    double q[STEPS_MAX + 1][SA01_JOINTS], qd[STEPS_MAX + 1][SA01_JOINTS];
    double omega[STEPS_MAX + 1][3], gravity[STEPS_MAX + 1][3];
    double torque[STEPS_MAX + 1][SA01_JOINTS]; /* entry k: applied from k - 1 to k */
    double velocity[STEPS_MAX + 1][6];
} Trace;

static Trace trace;

static void note_state(void) {
    int k = trace.count;
    Oracle o = oracle_of(rig.sim);
    memcpy(trace.q[k], robot_sim_qpos(rig.sim) + 7, sizeof trace.q[k]);
    memcpy(trace.qd[k], robot_sim_qvel(rig.sim) + 6, sizeof trace.qd[k]);
    memcpy(trace.velocity[k], robot_sim_qvel(rig.sim), sizeof trace.velocity[k]);
    memcpy(trace.omega[k], o.omega, sizeof o.omega);
    memcpy(trace.gravity[k], o.gravity, sizeof o.gravity);
}

static void note_step(void *context, const TaskEnv *env, const RobotSim *sim,
                      const double *torque) {
    assert_null(context);
    assert_ptr_equal(env, rig.env);
    assert_ptr_equal(sim, rig.sim);
    trace.count++;
    note_state();
    memcpy(trace.torque[trace.count], torque, sizeof trace.torque[0]);
}

/* One policy step, traced. */
static TaskStep traced_step(const float *action) {
    const TaskCallback callback = {note_step, NULL, NULL};
    trace.count = 0;
    task_env_load(rig.env, rig.sim);
    note_state();
    return task_env_step(rig.env, &rig.def, robot, rig.sim, action, 0, &rig.view, &callback);
}

/* A drive that asks for 3 N m of every joint, and for much more of the first of each leg. */
static void ask_torque(void *context, const TaskEnv *env, RobotSim *sim, double *torque) {
    int *calls = context;
    assert_ptr_equal(env, rig.env);
    assert_ptr_equal(sim, rig.sim);
    assert_int_equal(*calls, trace.count); /* before the step that it drives */
    (*calls)++;
    for (int i = 0; i < SA01_JOINTS; i++) {
        torque[i] = i == 0 ? 500 : i == LEG_JOINTS ? -500 : 3;
    }
}

static void put(const RobotState *state) {
    task_env_set_state(rig.env, state);
}

static void open_with_dt(double dt) {
    TaskDef def = kit_quiet_def();
    def.physics_dt = dt;
    def.crossing_limit = -1;
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0.5, 0, 0);
}

static int open_usual(void **state) {
    (void)state;
    open_with_dt(0.0025);
    return 0;
}

/* kp (q0 + scale a + offset - q) - kd qd with the gains of docs/policy.md section 5, by joint. */
static double wanted_torque(int i, const double *pose, double action, int k) {
    const double kp[LEG_JOINTS] = {50, 50, 70, 70, 20, 20}, kd[LEG_JOINTS] = {5, 5, 7, 7, 0.2, 0.2};
    const double limit[LEG_JOINTS] = {119, 119, 119, 119, 20.4, 20.4};
    int j = i % LEG_JOINTS;
    double tau = kp[j] * rig.env->kp_scale[i] *
                     (pose[i] + 0.5 * action + rig.env->motor_offset[i] - trace.q[k][i]) -
                 kd[j] * rig.env->kd_scale[i] * trace.qd[k][i];
    return fmin(fmax(tau * rig.env->strength, -limit[j]), limit[j]);
}

/* The torques of a drive take the place of the PD's at every physics step, within the limits. */
TEST_WITH(drive, open_usual, close_rig) {
    int calls = 0;
    const TaskDrive asked = {ask_torque, &calls};
    const TaskCallback callback = {note_step, NULL, &asked};
    float action[SA01_JOINTS] = {0};
    trace.count = 0;
    task_env_step(rig.env, &rig.def, robot, rig.sim, action, 0, &rig.view, &callback);
    assert_int_equal(calls, 4);
    for (int k = 1; k <= 4; k++) {
        for (int i = 0; i < SA01_JOINTS; i++) {
            const double wanted = i == 0 ? 119 : i == LEG_JOINTS ? -119 : 3;
            assert_true(trace.torque[k][i] == wanted);
        }
    }
}

/* Gains, strengths and offsets of every joint apart; some torques at their limits of 119 and 20.4
 * N m. */
TEST_WITH(torque, open_usual, close_rig) {
    int clipped = 0;
    for (uint32_t draw = 0; draw < 10; draw++) {
        RobotState state = kit_moving_state(2, draw);
        put(&state);
        float action[SA01_JOINTS];
        rig.env->strength = 1 + 0.01 * draw;
        for (int i = 0; i < SA01_JOINTS; i++) {
            rig.env->kp_scale[i] = 0.9 + 0.01 * i;
            rig.env->kd_scale[i] = 1.1 - 0.01 * i;
            rig.env->motor_offset[i] = 0.005 * (i - 4);
            action[i] = 0.125f * (float)((int)((5 * draw + 7 * (uint32_t)i) % 60) - 30);
        }
        traced_step(action);
        assert_int_equal(trace.count, 4);
        for (int k = 1; k <= 4; k++) {
            for (int i = 0; i < SA01_JOINTS; i++) {
                double wanted =
                    wanted_torque(i, robot_default_pose(robot), (double)action[i], k - 1);
                expect_entry("torque", i, trace.torque[k][i], wanted, 1e-9);
                clipped += fabs(wanted) == (i % LEG_JOINTS < 4 ? 119 : 20.4);
            }
        }
    }
    assert_true(clipped > 20);
}

static const int *counted; /* the state of the motors below */

/* Motors that ask for 10 N m/rad of the error, 1000 of joint 0, and count the steps of an episode
 * in their state. */
static void ask_for_error(const void *self, void *state, const double *error, const double *speed,
                          double *torque) {
    int *steps = state;
    assert_ptr_equal(self, &rig);
    assert_int_equal((size_t)(uintptr_t)state % 64, 0);
    (*steps)++;
    counted = steps;
    for (int i = 0; i < SA01_JOINTS; i++) {
        assert_true(speed[i] == robot_sim_qvel(rig.sim)[6 + i]);
        torque[i] = (i == 0 ? 1000 : 10) * error[i];
    }
}

/* The motors of the task take the place of the PD: times the strength, within the limits, with the
 * command's latency; held they are asked all the same; a new episode begins with a state of 0. */
TEST(motors) {
    const TaskActuator asked = {&rig, 64, ask_for_error};
    TaskDef def = kit_quiet_def();
    def.motors = &asked;
    for (int hold = 0; hold < 2; hold++) {
        def.torque_hold = hold;
        rig_open(&rig, &def, 3, 0);
        rig_start(&rig, 0.5, 0, 0);
        rig.env->lag_command = 2;
        rig.env->strength = 1.06;
        float action[2][SA01_JOINTS];
        for (int i = 0; i < SA01_JOINTS; i++) {
            rig.env->motor_offset[i] = 0.01 * i;
            action[0][i] = 0.1f * (float)(i + 1);
            action[1][i] = -0.05f * (float)(i + 2);
        }
        traced_step(action[0]);
        traced_step(action[1]);
        assert_int_equal(*counted, 8);
        for (int k = 1; k <= 4; k++) {
            const int from = hold ? 2 : k - 1, late = k - 1 < 2;
            for (int i = 0; i < SA01_JOINTS && !(hold && late); i++) {
                const double target =
                    robot_default_pose(robot)[i] + 0.5 * (double)action[!late][i] + 0.01 * i;
                const double wanted = 1.06 * (i == 0 ? 1000 : 10) * (target - trace.q[from][i]);
                expect_entry("torque", i, trace.torque[k][i], fmin(fmax(wanted, -119), 119), 1e-9);
            }
        }
        assert_true(fabs(trace.torque[4][0]) > 30);
        rig_start(&rig, 0.5, 0, 0);
        assert_int_equal(*counted, 0);
        rig_close(&rig);
    }
}

/* +-8; what is no number becomes -8. The two actions before are kept. */
TEST_WITH(action_is_clipped, open_usual, close_rig) {
    float action[SA01_JOINTS] = {9, -9, NAN, 7.5f, -7.5f, INFINITY};
    const float wanted[6] = {8, -8, -8, 7.5f, -7.5f, 8};
    float first[SA01_JOINTS] = {0.25f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -0.5f};
    rig_step(&rig, first);
    TaskStep step = rig_step(&rig, action);
    assert_true(step.valid && isfinite(step.reward));
    for (int i = 0; i < 6; i++) {
        assert_true(rig.env->action[0][i] == wanted[i]);
        assert_true(rig.frame[33 + i] == wanted[i]);
    }
    assert_memory_equal(rig.env->action[1], first, sizeof first);
    rig_step(&rig, NULL);
    assert_memory_equal(rig.env->action[2], first, sizeof first);
    assert_true(rig.env->action[1][0] == 8 && rig.env->action[0][0] == 0);
    rig.def.action_clip = 0.5;
    rig_step(&rig, action);
    assert_true(rig.env->action[0][0] == 0.5f && rig.env->action[0][1] == -0.5f);
}

/* The new action acts from physics step `lag` on, before it the previous one. */
static void command_latency(double dt, int steps) {
    open_with_dt(dt);
    float before[SA01_JOINTS], now[SA01_JOINTS];
    for (int i = 0; i < SA01_JOINTS; i++) {
        before[i] = 0.5f;
        now[i] = -0.25f;
    }
    for (int lag = 0; lag <= steps; lag++) {
        RobotState state = kit_moving_state(2, 20);
        put(&state);
        rig.env->lag_command = lag;
        memcpy(rig.env->action[0], before, sizeof before);
        traced_step(now);
        assert_int_equal(trace.count, steps);
        for (int k = 0; k < steps; k++) {
            double action = k < lag ? 0.5 : -0.25;
            for (int i = 0; i < SA01_JOINTS; i++) {
                expect_entry("torque under a late action", i, trace.torque[k + 1][i],
                             wanted_torque(i, robot_default_pose(robot), action, k), 1e-9);
            }
        }
    }
    rig_close(&rig);
}

/* With torque_hold the torque is that of the state and the action in the physics step in which the
 * action arrives, and stays for a policy period: over the border of the policy steps. */
static void held_torque(double dt, int steps) {
    for (int lag = 0; lag <= steps; lag++) {
        open_with_dt(dt);
        rig.def.torque_hold = 1;
        rig.env->lag_command = lag;
        const double *pose = robot_default_pose(robot);
        RobotState state = kit_moving_state(2, 20);
        put(&state);
        double wanted[SA01_JOINTS], action = 0, moved = 0;
        for (int t = 0; t < 3; t++) {
            float now[SA01_JOINTS];
            const double before = action;
            action = 0.5 - 0.25 * t;
            for (int i = 0; i < SA01_JOINTS; i++) {
                now[i] = (float)action;
            }
            traced_step(now);
            assert_int_equal(trace.count, steps);
            for (int k = 0; k < steps; k++) {
                const int acts = (t == 0 && k == 0) || k == lag % steps;
                for (int i = 0; i < SA01_JOINTS; i++) {
                    const double anew = wanted_torque(i, pose, k < lag ? before : action, k);
                    moved = fmax(moved, acts ? 0 : fabs(anew - wanted[i]));
                    wanted[i] = acts ? anew : wanted[i];
                    expect_entry("held torque", i, trace.torque[k + 1][i], wanted[i], 1e-9);
                }
            }
        }
        assert_true(moved > 1); /* a torque of the present state would be another */
        rig_close(&rig);
    }
}

TEST(torque_is_held) {
    held_torque(0.005, 2);
    held_torque(0.0025, 4);
    held_torque(0.001, 10);
}

static void expect_imu(const char *what, int k) {
    for (int i = 0; i < 3; i++) {
        expect_entry(what, i, (double)rig.frame[i], trace.omega[k][i], 2e-6);
        expect_entry(what, 6 + i, (double)rig.frame[6 + i], trace.gravity[k][i], 2e-7);
    }
}

static void expect_motors(const char *what, int k) {
    const double *pose = robot_default_pose(robot);
    for (int i = 0; i < SA01_JOINTS; i++) {
        expect_entry(what, 9 + i, (double)rig.frame[9 + i], trace.q[k][i] - pose[i], 2e-7);
        expect_entry(what, 21 + i, (double)rig.frame[21 + i], 0.05 * trace.qd[k][i], 2e-6);
    }
}

/* Readings are of so many physics steps before the period's end; each sensor has its own. */
static void reading_latencies(double dt, int steps) {
    open_with_dt(dt);
    const float action[SA01_JOINTS] = {1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1};
    for (int imu = 0; imu <= steps; imu++) {
        int motor = (2 * imu + 1) % (steps + 1);
        RobotState state = kit_moving_state(2, 21);
        put(&state);
        rig.env->lag_imu = imu;
        rig.env->lag_motor = motor;
        traced_step(action);
        for (int k = 0; k < steps; k++) { /* the states can be told from each other */
            assert_true(fabs(trace.omega[k][0] - trace.omega[k + 1][0]) > 1e-3);
            assert_true(fabs(trace.qd[k][0] - trace.qd[k + 1][0]) > 1e-3);
            assert_true(fabs(trace.q[k][1] - trace.q[k + 1][1]) > 1e-5);
        }
        expect_imu("late IMU", steps - imu);
        expect_motors("late motors", steps - motor);
        /* the critic sees the end */
        expect_entry("critic", 0, (double)rig.critic[0], trace.omega[steps][0], 2e-6);
        expect_entry("critic", 21, (double)rig.critic[21], 0.05 * trace.qd[steps][0], 2e-6);
    }
    rig_close(&rig);
}

TEST(latencies) {
    command_latency(0.0025, 4);
    command_latency(0.001, 10);
    command_latency(0.0005, 20);
    reading_latencies(0.0025, 4);
    reading_latencies(0.001, 10);
    reading_latencies(0.005, 2);
}

/* Redrawn every 8 s; the policy sees it one policy step after it is in force. */
TEST_WITH(command_is_seen_late, open_usual, close_rig) {
    rig.env->command_frozen = 0;
    rig.def.command_interval = 0.05;
    rig.def.standing_share = 0;
    rig.def.vx[0] = 0.2;
    rig.def.straight_share = 0;
    double before[3];
    for (int t = 1; t <= 20; t++) {
        memcpy(before, rig.env->command, sizeof before);
        rig_step(&rig, NULL);
        assert_int_equal(rig.env->step, t);
        int redrawn = memcmp(before, rig.env->command, sizeof before) != 0;
        assert_int_equal(redrawn, t % 5 == 0);
        for (int i = 0; i < 3; i++) {
            expect_entry("seen", i, (double)rig.frame[3 + i], before[i] * (i < 2 ? 2 : 1), 1e-6);
        }
    }
}

/* 0.125 s are 12.5 policy steps: 13, for the command, the push and the end of an episode. */
TEST(intervals_are_rounded) {
    TaskDef def = kit_quiet_def();
    def.episode = 0.125;
    rig_open(&rig, &def, 3, 0);
    assert_int_equal(rig.env->step_limit, 13);
    rig_close(&rig);
    open_with_dt(0.0025);
    rig.env->command_frozen = 0;
    rig.def.standing_share = 0;
    rig.def.vx[0] = 0.2;
    rig.def.command_interval = rig.def.randomize.push_interval = 0.125;
    for (int t = 1; t <= 27; t++) {
        RobotState state = kit_state(2);
        double command = rig.env->command[0], push = rig.env->push[0];
        uint32_t step = rig.env->step;
        put(&state);
        rig_step(&rig, NULL);
        assert_int_equal(rig.env->command[0] != command, t % 13 == 0);
        int pushed = fabs(rig.env->push[0] - 0.95 * push) > 1e-12;
        assert_int_equal(pushed, step > 0 && step % 13 == 0);
    }
    rig_close(&rig);
}

/* 0.01 s of a period of 0.8 s is 1/80. */
TEST_WITH(clock_runs, open_usual, close_rig) {
    rig.env->phase = 0.503;
    for (int t = 1; t <= 100; t++) {
        RobotState state = kit_state(2);
        put(&state);
        rig_step(&rig, NULL);
        double phase = 0.503 + t / 80.0;
        expect_near("phase", rig.env->phase, phase - floor(phase), 1e-9);
    }
    rig.def.gait_period = 0.5;
    double before = rig.env->phase;
    rig_step(&rig, NULL);
    expect_near("a shorter period", rig.env->phase, before + 0.02, 1e-12);
    /* the command that the action answers to slows it, not one that came after */
    const double seen[3] = {0.3, 0, 0}, later[3] = {1.2, 0, 0};
    rig.def.gait_slowing = 0.6;
    memcpy(rig.env->command_seen, seen, sizeof seen);
    memcpy(rig.env->command, later, sizeof later);
    before = rig.env->phase;
    rig_step(&rig, NULL);
    expect_near("a slow command", rig.env->phase, before + 0.02 / 1.45, 1e-12);
    before = rig.env->phase;
    rig_step(&rig, NULL);
    expect_near("a fast command", rig.env->phase, before + 0.02, 1e-12);
}

/* A phase and a state of the step's end: the reward's clock is that of the action. */
TEST_WITH(reward_follows_the_clock_of_the_action, open_usual, close_rig) {
    RobotState state = kit_state(2);
    put(&state); /* in the air: no contact; left scheduled to stand, right to swing */
    rig.env->phase = 0.499;
    rig_step(&rig, NULL);
    /* mean of -0.3 and 1 outside double support; at 0.499 either is right: 1.4 */
    expect_near("gait", rig.env->term_sum[REWARD_gait], 0.014, 1e-9);
    rig.env->phase = 0.48;
    put(&state);
    rig_step(&rig, NULL);
    expect_near("gait", rig.env->term_sum[REWARD_gait], 0.014 + 0.0049, 1e-9);
}

/* The torque of the last physics step is the one that the reward sees. */
TEST_WITH(reward_sees_the_torque, open_usual, close_rig) {
    RobotState state = kit_moving_state(2, 5);
    put(&state);
    const float action[SA01_JOINTS] = {1, 1, 1, 1, 1, 1};
    traced_step(action);
    double sum = 0, speed = 0;
    for (int i = 0; i < SA01_JOINTS; i++) {
        sum += trace.torque[4][i] * trace.torque[4][i];
        speed += trace.qd[4][i] * trace.qd[4][i];
    }
    expect_near("torque", rig.env->term_sum[REWARD_torque], -1e-12 * sum, 1e-15 * sum);
    expect_near("joint speed", rig.env->term_sum[REWARD_joint_speed], -1e-7 * speed, 1e-10 * speed);
}

/* The sweeps and the fast solver are the user's choice, with the task's tolerance. */
TEST_WITH(solver_follows_the_keys, open_usual, close_rig) {
    for (int newton = 0; newton < 2; newton++) {
        rig.def.solver = newton ? MILD_SOLVER_NEWTON : MILD_SOLVER_GAUSS_SEIDEL;
        rig.def.contact_tolerance = newton ? 1e-3 : 1e-5;
        rig.def.contact_iterations = 30 + newton;
        rig_step(&rig, NULL);
        const MildContactInput *input = robot_sim_contact_input(rig.sim);
        assert_int_equal(input->solver, newton ? MILD_SOLVER_NEWTON : MILD_SOLVER_GAUSS_SEIDEL);
        expect_near("tolerance", input->tolerance, newton ? 1e-3 : 1e-5, 0);
        assert_int_equal(input->max_iterations, 30 + newton);
    }
}

/* 88 N m up to 22 rad/s, half of it half way to 32 rad/s, none from there on; a brake has all. */
TEST(torque_falls_with_speed) {
    const struct {
        double qd, forward, backward;
    } rows[] = {{0, 88, -88}, {21.9, 88, -88}, {27, 44, -88},  {31, 8.8, -88},
                {32, 0, -88}, {40, 0, -88},    {-27, 88, -44}, {-32, 88, 0}};
    TaskMotor motor = {.kp = 1, .limit = 88, .fastest = 32, .full = 22};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        motor.target[0] = 1000;
        expect_entry("forward", (int)i, task_torque(&motor, 0, 0, rows[i].qd), rows[i].forward,
                     1e-12);
        motor.target[0] = -1000;
        expect_entry("backward", (int)i, task_torque(&motor, 0, 0, rows[i].qd), rows[i].backward,
                     1e-12);
    }
    motor.full = 0; /* all of it up to 32 rad/s */
    expect_near("forward", task_torque(&motor, 0, -2000, 31.9), 88, 0);
    expect_near("forward", task_torque(&motor, 0, -2000, 32), 0, 0);
}

TEST_MAIN(kit_setup, kit_teardown)
