/* What the rewards look at: every entry of TaskMotion at states in motion against the engine's own
 * functions or a hand's. */
#include "sa01.h"
#include "task_oracle.h"

#define TOLERANCE 1e-9

static TaskMotion describe_step(const double *torque) {
    RobotReading reading;
    task_env_read(rig.env, rig.sim, &reading);
    return task_describe_motion(rig.env, &rig.def, robot_table(robot), &reading, torque);
}

static TaskMotion describe(void) {
    static const double torque[SA01_JOINTS];
    return describe_step(torque);
}

TEST_WITH(base_and_joints, open_quiet, close_rig) {
    for (uint32_t draw = 0; draw < 20; draw++) {
        Oracle o = rig_place(&rig, draw);
        double torque[SA01_JOINTS];
        for (int i = 0; i < SA01_JOINTS; i++) {
            rig.env->joint_speed[i] = 0.1 * i;
            torque[i] = 3 - i;
        }
        TaskMotion m = describe_step(torque);
        for (int i = 0; i < 3; i++) {
            expect_entry("velocity", i, m.velocity[i], o.heading[i], TOLERANCE);
            expect_entry("omega", i, m.omega[i], o.omega[i], TOLERANCE);
            expect_entry("gravity", i, m.gravity[i], o.gravity[i], TOLERANCE);
        }
        for (int i = 0; i < SA01_JOINTS; i++) {
            expect_entry("q", i, m.q[i], rig.env->robot.qpos[7 + i], 0);
            expect_entry("qd", i, m.qd[i], rig.env->robot.qvel[6 + i], 0);
            expect_entry("qd_before", i, m.qd_before[i], 0.1 * i, 0);
            expect_entry("joint_speed", i, rig.env->joint_speed[i], m.qd[i], 0);
            expect_entry("torque", i, m.torque[i], torque[i], 0);
        }
        assert_ptr_equal(m.robot, robot_table(robot));
        assert_ptr_equal(m.env, rig.env);
        assert_ptr_equal(m.def, &rig.def);
    }
}

/* Of differences of 0.1, -0.2, 0.2 m/s and -0.4 rad/s the norm is 0.5, that of the linear part
 * alone 0.3; each component counts. */
TEST_WITH(change_of_twist, open_quiet, close_rig) {
    const double step[6] = {0.1, -0.2, 0.2, 0, -0.4, 0};
    for (int linear = 0; linear < 2; linear++) {
        rig.def.reward.acceleration_form =
            linear ? TASK_ACCELERATION_LINEAR : TASK_ACCELERATION_TWIST;
        for (int k = -1; k < 6; k++) {
            rig_place(&rig, 3);
            for (int i = 0; i < 6; i++) {
                double change = k < 0 ? step[i] : i == k ? 0.3 : 0;
                rig.env->base_twist[i] = rig.env->robot.qvel[i] - change;
            }
            const double wanted = linear && k >= 3 ? 0 : k < 0 && !linear ? 0.5 : 0.3;
            expect_entry("twist_change", k, describe().twist_change, wanted, TOLERANCE);
            for (int i = 0; i < 6; i++) {
                expect_entry("base_twist", i, rig.env->base_twist[i], rig.env->robot.qvel[i], 0);
            }
            expect_near("the next one", describe().twist_change, 0, 0);
        }
    }
}

/* One step of 0.01 s moves a mean over 0.4 s by a fortieth of the way. */
TEST_WITH(smoothed_velocity, open_quiet, close_rig) {
    Oracle o = rig_place(&rig, 4);
    const double before[3] = {0.3, -0.2, 0.7}, now[3] = {o.heading[0], o.heading[1], o.omega[2]};
    memcpy(rig.env->smooth_velocity, before, sizeof before);
    describe();
    for (int i = 0; i < 3; i++) {
        expect_entry("smooth", i, rig.env->smooth_velocity[i],
                     before[i] + 0.025 * (now[i] - before[i]), TOLERANCE);
    }
    rig.def.reward.tracking_time = 0.01;
    describe();
    for (int i = 0; i < 3; i++) {
        expect_entry("not smoothed", i, rig.env->smooth_velocity[i], now[i], TOLERANCE);
    }
}

TEST_WITH(feet_and_knees, open_quiet, close_rig) {
    for (uint32_t draw = 0; draw < 20; draw++) {
        Oracle o = rig_place(&rig, draw);
        oracle_set_force(rig.sim, 0, 3, -4, 12);
        oracle_set_force(rig.sim, 1, 30, -60, -20);
        TaskMotion m = describe();
        for (int f = 0; f < SA01_FEET; f++) {
            expect_entry("foot_height", f, m.foot_height[f], o.sole_lowest[f] - 0.05, TOLERANCE);
            expect_entry("foot_speed", f, m.foot_speed[f],
                         hypot(o.sole_velocity[f][0], o.sole_velocity[f][1]), TOLERANCE);
        }
        expect_near("foot_force[0]", m.foot_force[0], 13, TOLERANCE);
        expect_near("foot_force[1]", m.foot_force[1], 70, TOLERANCE);
        expect_near("foot_distance", m.foot_distance, o.foot_distance, TOLERANCE);
        expect_near("knee_distance", m.knee_distance, o.knee_distance, TOLERANCE);
    }
}

/* Above the soles that stand by the clock: left at phase 1/4, right at 3/4, both when standing. */
TEST_WITH(schedule, open_quiet, close_rig) {
    Oracle o = rig_place(&rig, 5);
    double z = rig.env->robot.qpos[2];
    rig.env->phase = 0.25;
    TaskMotion m = describe();
    assert_false(m.standing);
    assert_true(m.wanted[0].stance && !m.wanted[1].stance);
    expect_near("wanted left", m.wanted[0].height, 0, 0);
    expect_near("wanted right", m.wanted[1].height, 0.1, TOLERANCE);
    expect_near("base above the left sole", m.base_height, z - o.sole[0][2], TOLERANCE);
    rig.env->phase = 0.75;
    m = describe();
    assert_true(!m.wanted[0].stance && m.wanted[1].stance);
    expect_near("base above the right sole", m.base_height, z - o.sole[1][2], TOLERANCE);
    rig.env->command[0] = 3;
    rig.def.stance_share[0] = 0.35;
    rig.env->phase = 0.9; /* flight: above the ground, level at 0.05 m */
    m = describe();
    assert_true(!m.wanted[0].stance && !m.wanted[1].stance);
    expect_near("base in flight", m.base_height, z - 0.05, TOLERANCE);
    memset(rig.env->command, 0, sizeof rig.env->command);
    m = describe();
    assert_true(m.standing && m.wanted[0].stance && m.wanted[1].stance);
    expect_near("base above both", m.base_height, z - 0.5 * (o.sole[0][2] + o.sole[1][2]),
                TOLERANCE);
    expect_near("wanted left", m.wanted[0].height, 0, 0);
}

/* Contact is a vertical force above 5 N; sideways forces are none. */
TEST_WITH(contact_and_air_time, open_quiet, close_rig) {
    rig_place(&rig, 7);
    rig.env->air_time[0] = 0.30;
    rig.env->air_time[1] = 0.10;
    oracle_set_force(rig.sim, 0, 100, 0, 4.99);
    oracle_set_force(rig.sim, 1, 0, 0, -100);
    TaskMotion m = describe();
    assert_true(!m.contact[0] && !m.contact[1]);
    expect_near("nobody landed", m.landed_air_time, 0, 0);
    expect_near("0.01 s longer in the air", rig.env->air_time[0], 0.31, TOLERANCE);
    expect_near("0.01 s longer in the air", rig.env->air_time[1], 0.11, TOLERANCE);
    oracle_set_force(rig.sim, 0, 0, 0, 5.01);
    m = describe();
    assert_true(m.contact[0] && !m.contact[1]);
    expect_near("the left landed", m.landed_air_time, 0.31, TOLERANCE);
    expect_near("it is on the ground", rig.env->air_time[0], 0, 0);
    expect_near("the right is not", rig.env->air_time[1], 0.12, TOLERANCE);
    expect_near("paid once", describe().landed_air_time, 0, 0);
    rig.env->air_time[0] = 0.2;
    rig.env->air_time[1] = 0.7; /* at most half a gait period, 0.4 s */
    oracle_set_force(rig.sim, 1, 0, 0, 300);
    expect_near("both landed", describe().landed_air_time, 0.6, TOLERANCE);
    rig.env->air_time[0] = 0.2;
    rig.env->air_time[1] = 0.7; /* of the period that the command slows, 1.1 s */
    rig.env->command_seen[0] = 0.3;
    rig.env->command_seen[1] = rig.env->command_seen[2] = 0;
    rig.def.gait_slowing = 0.5;
    expect_near("under a slow clock", describe().landed_air_time, 0.75, TOLERANCE);
}

TEST_MAIN(kit_setup, kit_teardown)
