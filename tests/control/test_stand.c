/* The balanced stand: its pose and torques against statics, its answer to a tilt against geometry,
 * the same whichever way the robot looks. That it stands: robot/test_stand. */
#include <mujoco/mujoco.h>

#include "base/random.h"
#include "control/stand.h"
#include "robots.h"
#include "sa01.h"

#define SWAY 0.15 /* [s] of stand.c */
#define GRAVITY 9.81

enum { ROBOTS = 2 };
static const char *const names[ROBOTS] = {"sa01", "go1"}; /* with ankles and without */
static Robot *robots[ROBOTS];
static Stand *stands[ROBOTS];

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robots[0] = robot_create(SA01, &error);
    robots[1] = robots[0] ? robot_create(MILD_SOURCE_DIR "/robots/go1", &error) : NULL;
    for (int r = 0; r < ROBOTS; r++) {
        stands[r] = robots[r] ? stand_create(robots[r], &error) : NULL;
        if (!stands[r]) {
            fprintf(stderr, "%s\n", error.text);
            return 1;
        }
    }
    return 0;
}

static int teardown(void **state) {
    (void)state;
    for (int r = 0; r < ROBOTS; r++) {
        stand_destroy(stands[r]);
    }
    robot_destroy(robots[0]);
    robot_destroy(robots[1]);
    return 0;
}

static RobotSim *sim_at(const Robot *robot, const RobotState *state) {
    MildError error = {0};
    RobotVariation nominal = robot_variation_nominal();
    RobotSim *sim = robot_sim_create(robot, 0.001, &error);
    assert_non_null(sim);
    robot_sim_load(sim, state, &nominal);
    return sim;
}

static double lean_of(const RobotState *state) {
    return 2 * atan2(state->qpos[5], state->qpos[3]);
}

/* The torque that stand_pd owes: a spring to the pose, its ankles turned back by the lean, and what
 * is fed forward, within the effort. */
static double owed(int r, int joint, double q, double qd, double lean, double forward) {
    const Robot *robot = robots[r];
    double wanted = robot_default_pose(robot)[joint];
    for (int f = 0; f < robot_feet(robot); f++) {
        wanted -= robot_ankle(robot, f) == joint ? lean : 0;
    }
    double torque =
        robot_stand_kp(robot)[joint] * (wanted - q) - robot_stand_kd(robot)[joint] * qd + forward;
    double effort = robot_effort(robot)[joint];
    return fmin(fmax(torque, -effort), effort);
}

/* The state's centre of mass is over the middle of the soles, the lowest sole at z = -sinkage, the
 * middle of the feet at x = 0; unbalanced it is the default pose, upright. */
TEST(test_pose) {
    for (int r = 0; r < ROBOTS; r++) {
        const Robot *robot = robots[r];
        RobotState plain = stand_state(stands[r], 0, 0.02), leant = stand_state(stands[r], 1, 0.02);
        const double lean = lean_of(&leant);
        assert_true(fabs(plain.qpos[2] - (robot_stand_height(robot) - 0.02)) < 1e-12);
        assert_true(plain.qpos[0] == 0 && plain.qpos[1] == 0 && plain.qpos[3] == 1);
        for (int i = 0; i < robot_joints(robot); i++) {
            double back = 0;
            for (int f = 0; f < robot_feet(robot); f++) {
                back += robot_ankle(robot, f) == i ? lean : 0;
            }
            assert_true(plain.qpos[7 + i] == robot_default_pose(robot)[i]);
            assert_true(fabs(leant.qpos[7 + i] - (plain.qpos[7 + i] - back)) < 1e-12);
        }
        assert_true(fabs(leant.qpos[3] * leant.qpos[3] + leant.qpos[5] * leant.qpos[5] - 1) <
                    1e-12);
        RobotSim *sim = sim_at(robot, &leant);
        const mjData *d = robot_sim_data(sim);
        double sole = 0, foot = 0, lowest = 1e9;
        for (int f = 0; f < robot_feet(robot); f++) {
            sole += robot_sim_foot(sim, f)->sole_center[0] / robot_feet(robot);
            foot += robot_sim_foot(sim, f)->position[0] / robot_feet(robot);
            lowest = fmin(lowest, robot_sim_foot(sim, f)->sole_height);
        }
        printf("%s: leans %.4f rad, centre of mass %.1e m from the soles' middle, lowest sole at "
               "%.6f m, feet at %.1e m\n",
               names[r], lean, d->subtree_com[3] - sole, lowest, foot);
        assert_true(fabs(lowest + 0.02) < 1e-9 && fabs(foot) < 1e-9);
        assert_true(r ? lean == 0 : fabs(d->subtree_com[3] - sole) < 1e-9 && fabs(lean) > 0.01);
        robot_sim_destroy(sim);
    }
}

/* Vertical forces at the middles of the soles and the joints' torques hold the whole robot at rest:
 * they balance gravity in every coordinate. The forces come from the base's rows alone. */
TEST(test_torque_at_rest) {
    for (int r = 0; r < ROBOTS; r++) {
        const Robot *robot = robots[r];
        const int feet = robot_feet(robot), joints = robot_joints(robot);
        RobotState rest = stand_state(stands[r], 1, 0);
        RobotSim *sim = sim_at(robot, &rest);
        mjModel *m = robot_sim_model(sim);
        mjData *d = robot_sim_data(sim);
        double torque[ROBOT_JOINTS_MAX], none[ROBOT_JOINTS_MAX] = {0}, worst = 0;
        double jacobian[ROBOT_FEET_MAX][3 * ROBOT_NV_MAX], load[ROBOT_FEET_MAX];
        stand_pd(stands[r], 1, rest.qpos + 7, none, torque);
        mj_forward(m, d);
        for (int f = 0; f < feet; f++) { /* alike, but for what a centre of mass aside needs */
            const double *p = robot_sim_foot(sim, f)->sole_center, *com = d->subtree_com + 3;
            double x = 0, y = 0, square[2] = {0};
            for (int g = 0; g < feet; g++) {
                const double *other = robot_sim_foot(sim, g)->sole_center;
                x += (other[0] - com[0]) / feet, y += (other[1] - com[1]) / feet;
                square[0] += pow(other[0] - com[0], 2), square[1] += pow(other[1] - com[1], 2);
            }
            double share = 1.0 / feet;
            share -= square[0] > 0.01 ? x * (p[0] - com[0]) / square[0] : 0;
            share -= square[1] > 0.01 ? y * (p[1] - com[1]) / square[1] : 0;
            load[f] = share * robot_total_mass(robot) * GRAVITY;
            mj_jac(m, d, jacobian[f], NULL, p, robot_foot_body(robot, f));
        }
        for (int i = 0; i < joints; i++) {
            int dof = robot_joint_dof(robot)[i];
            double held = torque[i];
            for (int f = 0; f < feet; f++) {
                held += load[f] * jacobian[f][2 * m->nv + dof];
            }
            worst = fmax(worst, fabs(held - d->qfrc_bias[dof]));
        }
        stand_pd(stands[r], 0, robot_default_pose(robot), none, none);
        printf("%s at rest: %.1e N m missing at a joint\n", names[r], worst);
        assert_true(worst < 5e-3);
        for (int i = 0; i < joints; i++) {
            assert_true(none[i] == 0); /* without balance nothing is fed forward */
        }
        robot_sim_destroy(sim);
    }
}

TEST(test_spring) {
    for (int r = 0; r < ROBOTS; r++) {
        const Robot *robot = robots[r];
        const int joints = robot_joints(robot);
        RobotState rest = stand_state(stands[r], 1, 0);
        const double lean = lean_of(&rest), zero[ROBOT_JOINTS_MAX] = {0};
        double forward[ROBOT_JOINTS_MAX], q[ROBOT_JOINTS_MAX], qd[ROBOT_JOINTS_MAX],
            torque[ROBOT_JOINTS_MAX];
        Random random = random_at(3, (uint32_t)r, 0);
        int bounded = 0;
        stand_pd(stands[r], 1, rest.qpos + 7, zero, forward);
        for (int draw = 0; draw < 100; draw++) {
            const double size = draw % 2 ? 0.05 : 2;
            for (int i = 0; i < joints; i++) {
                q[i] = robot_default_pose(robot)[i] + random_uniform(&random, -size, size);
                qd[i] = random_uniform(&random, -3, 3);
            }
            for (int balance = 0; balance < 2; balance++) {
                stand_pd(stands[r], balance, q, qd, torque);
                for (int i = 0; i < joints; i++) {
                    double wanted =
                        owed(r, i, q[i], qd[i], balance * lean, balance ? forward[i] : 0);
                    assert_true(fabs(torque[i] - wanted) < 1e-9);
                    bounded += fabs(torque[i]) == robot_effort(robot)[i];
                }
            }
        }
        assert_true(bounded > 10);
    }
}

/* The rest state turned about the vertical, then pitched and rolled (world axes), its base moving
 * forward and left in its own heading [m/s]. */
static RobotState tilted(int r, double yaw, double pitch, double roll, double forward,
                         double left) {
    RobotState at = stand_state(stands[r], 1, 0);
    const double turns[3][4] = {{cos(yaw / 2), 0, 0, sin(yaw / 2)},
                                {cos(pitch / 2), 0, sin(pitch / 2), 0},
                                {cos(roll / 2), sin(roll / 2), 0, 0}};
    double tilt[4], turn[4], q[4], heading[3] = {1, 0, 0}, ahead[3];
    mju_mulQuat(tilt, turns[1], turns[2]);
    mju_mulQuat(turn, turns[0], tilt);
    mju_mulQuat(q, turn, at.qpos + 3);
    memcpy(at.qpos + 3, q, sizeof q);
    mju_rotVecQuat(ahead, heading, turns[0]);
    at.qvel[0] = ahead[0] * forward - ahead[1] * left;
    at.qvel[1] = ahead[1] * forward + ahead[0] * left;
    return at;
}

/* Offsets [rad] of the pose that the answer to the tilt makes. */
static void answer(int r, const RobotState *at, double *offset) {
    const Robot *robot = robots[r];
    double torque[ROBOT_JOINTS_MAX], still[ROBOT_JOINTS_MAX];
    RobotSim *sim = sim_at(robot, at);
    stand_torque(stands[r], sim, 1, torque);
    stand_pd(stands[r], 1, robot_sim_qpos(sim) + 7, robot_sim_qvel(sim) + 6, still);
    for (int i = 0; i < robot_joints(robot); i++) {
        assert_true(fabs(torque[i]) < robot_effort(robot)[i]);
        offset[i] = (torque[i] - still[i]) / robot_stand_kp(robot)[i];
    }
    double target[ROBOT_JOINTS_MAX];
    stand_target(stands[r], sim, target); /* the same torque, as a target of the same spring */
    for (int i = 0; i < robot_joints(robot); i++) {
        double spring = robot_stand_kp(robot)[i] * (target[i] - robot_sim_qpos(sim)[7 + i]) -
                        robot_stand_kd(robot)[i] * robot_sim_qvel(sim)[6 + i];
        assert_true(fabs(spring - torque[i]) < 1e-9);
    }
    double plain[ROBOT_JOINTS_MAX];
    stand_torque(stands[r], sim, 0, torque); /* without balance the tilt is no matter */
    stand_pd(stands[r], 0, robot_sim_qpos(sim) + 7, robot_sim_qvel(sim) + 6, plain);
    assert_memory_equal(torque, plain, sizeof *plain * (size_t)robot_joints(robot));
    robot_sim_destroy(sim);
}

/* [m] How much higher than the mean each foot stands under the upright base with these offsets. */
static void rises(int r, const double *offset, double *rise) {
    const Robot *robot = robots[r];
    RobotState at = stand_state(stands[r], 1, 0);
    RobotSim *before = sim_at(robot, &at);
    for (int i = 0; i < robot_joints(robot); i++) {
        at.qpos[7 + i] += offset[i];
    }
    RobotSim *after = sim_at(robot, &at);
    for (int f = 0; f < robot_feet(robot); f++) {
        rise[f] =
            robot_sim_foot(after, f)->sole_center[2] - robot_sim_foot(before, f)->sole_center[2];
    }
    robot_sim_destroy(before);
    robot_sim_destroy(after);
}

/* A small tilt: the legs' lengths follow the plane through the feet, so that the base is level
 * again; ankles follow the sole. The base's speed counts as SWAY times its angle about the feet. */
TEST(test_answer_to_tilt) {
    static const double cases[][4] = {/* pitch, roll [rad], forward, left [m/s] */
                                      {0.02, 0, 0, 0},   {-0.015, 0, 0.1, 0},
                                      {0, 0.02, 0, 0},   {0, -0.01, 0, 0.1},
                                      {0, 0, 0.1, 0.05}, {0.01, 0.015, -0.05, 0.05}};
    for (int r = 0; r < ROBOTS; r++) {
        const Robot *robot = robots[r];
        double worst = 0, most = 0;
        for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
            const double *c = cases[k], height = robot_stand_height(robot);
            RobotState at = tilted(r, 0, c[0], c[1], c[2], c[3]),
                       rest = stand_state(stands[r], 1, 0);
            double offset[ROBOT_JOINTS_MAX], rise[ROBOT_FEET_MAX];
            answer(r, &at, offset);
            for (int f = 0; f < robot_feet(robot); f++) {
                const int ankle = robot_ankle(robot, f);
                if (ankle >= 0) { /* what is left is its part of the leg's bend */
                    offset[ankle] -= c[0] + SWAY * c[2] / height;
                    assert_true(c[1] != 0 || c[3] != 0 || fabs(offset[ankle]) < 1e-6);
                }
            }
            rises(r, offset, rise);
            RobotSim *sim = sim_at(robot, &rest);
            double middle[2] = {0};
            for (int f = 0; f < robot_feet(robot); f++) {
                for (int i = 0; i < 2; i++) {
                    middle[i] += robot_sim_foot(sim, f)->position[i] / robot_feet(robot);
                }
            }
            for (int f = 0; f < robot_feet(robot); f++) {
                const double *p = robot_sim_foot(sim, f)->position;
                double roll = c[1] - SWAY * c[3] / height, pitch = -c[0] - SWAY * c[2] / height;
                double wanted = (p[1] - middle[1]) * roll;
                wanted += robot_ankle(robot, f) < 0 ? (p[0] - middle[0]) * pitch : 0;
                worst = fmax(worst, fabs(rise[f] - wanted));
                most = fmax(most, fabs(wanted));
            }
            robot_sim_destroy(sim);
        }
        printf("%s: a foot rises by up to %.1f mm, off by %.2f mm\n", names[r], 1e3 * most,
               1e3 * worst);
        assert_true(worst < 0.05 * most && most > 1e-3);
    }
}

/* A large tilt is answered as one of 0.3 rad. */
TEST(test_answer_is_bounded) {
    for (int r = 0; r < ROBOTS; r++) {
        const Robot *robot = robots[r];
        const int ankle = robot_ankle(robot, 0);
        double target[5][ROBOT_JOINTS_MAX];
        for (int k = 0; k < 5; k++) { /* none, pitched, rolled */
            static const double tilt[5] = {0, 0.5, -0.5, 0.4, -0.4};
            RobotState at = tilted(r, 0, k < 3 ? tilt[k] : 0, k < 3 ? 0 : tilt[k], 0, 0);
            RobotSim *sim = sim_at(robot, &at);
            stand_target(stands[r], sim, target[k]);
            robot_sim_destroy(sim);
        }
        if (ankle >= 0) {
            assert_true(fabs(target[1][ankle] - target[0][ankle] - 0.3) < 1e-9);
            assert_true(fabs(target[2][ankle] - target[0][ankle] + 0.3) < 1e-9);
        }
        double once[ROBOT_JOINTS_MAX];
        RobotState at = tilted(r, 0, 0, 0.3, 0, 0);
        RobotSim *sim = sim_at(robot, &at);
        stand_target(stands[r], sim, once);
        robot_sim_destroy(sim);
        for (int i = 0; i < robot_joints(robot); i++) { /* feet 0.3 rad aside are nearer in y */
            double much = target[3][i] - target[0][i], some = once[i] - target[0][i];
            assert_true(fabs(much - some * cos(0.4) / cos(0.3)) < 0.02 * fabs(some) + 1e-3);
        }
    }
}

/* Whichever way it looks, the torques are the same. */
TEST(test_heading) {
    for (int r = 0; r < ROBOTS; r++) {
        double worst = 0, first[ROBOT_JOINTS_MAX], turned[ROBOT_JOINTS_MAX];
        RobotState at = tilted(r, 0, 0.02, -0.03, 0.1, 0.05);
        answer(r, &at, first);
        for (int k = 1; k < 8; k++) {
            RobotState other = tilted(r, 0.9 * k, 0.02, -0.03, 0.1, 0.05);
            other.qpos[0] += 3 * k;
            other.qpos[1] -= k;
            answer(r, &other, turned);
            for (int i = 0; i < robot_joints(robots[r]); i++) {
                worst = fmax(worst, fabs(turned[i] - first[i]));
            }
        }
        printf("%s: looking elsewhere it answers by %.1e rad another way\n", names[r], worst);
        assert_true(worst < 1e-9);
    }
}

TEST_MAIN(setup, teardown)
