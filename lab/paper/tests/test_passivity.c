/* The passivity-based controller: its torques against the dynamics of MuJoCo, then standing and
 * walking. */
#include <mujoco/mujoco.h>

#include "control/controller.h"
#include "paper/control/body.h"
#include "robots.h"

#define GRAVITY 9.81
enum { NV = 18 };

static Robot *robot;

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_open("sa01", &error);
    return robot == NULL;
}

static int teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

/* ---- torques ---- */

/* Upright in the default pose with the soles on the ground; everything moves a little. */
static RobotState some_state(double speed) {
    RobotState state = {.qpos = {0, 0, robot_stand_height(robot), 1, 0, 0, 0}};
    for (int i = 0; i < robot_joints(robot); i++) {
        state.qpos[7 + i] = robot_default_pose(robot)[i] + 0.02 * ((i * 7) % 5 - 2);
    }
    for (int i = 0; i < NV; i++) {
        state.qvel[i] = speed * ((i * 5) % 7 - 3);
    }
    return state;
}

/* Accelerations of MuJoCo's model under the torques and the shares of the ground, each on its foot
 * at its support point. */
static void accelerate(RobotSim *sim, const Body *body, const WalkState *state,
                       const double *torque, double qacc[NV]) {
    mjModel *m = robot_sim_model(sim);
    mjData *d = robot_sim_data(sim);
    double wanted[WRENCH_SIZE], share[WALK_FEET][WRENCH_SIZE];
    body_wrenches(body, wanted, share);
    mj_forward(m, d);
    mju_scl(d->qfrc_smooth, d->qfrc_bias, -1, NV);
    for (int i = 0; i < robot_joints(robot); i++) {
        d->qfrc_smooth[robot_joint_dof(robot)[i]] += torque[i];
    }
    for (int f = 0; f < WALK_FEET; f++) {
        mj_applyFT(m, d, share[f], share[f] + 3, state->support[f], robot_foot_body(robot, f),
                   d->qfrc_smooth);
    }
    mj_solveM(m, d, qacc, d->qfrc_smooth, 1);
}

/* [m/s^2] Acceleration of a point of a foot. */
static void foot_acceleration(RobotSim *sim, int f, const double point[3], const double qacc[NV],
                              double linear[3], double angular[3]) {
    mjModel *m = robot_sim_model(sim);
    mjData *d = robot_sim_data(sim);
    double j[2][3 * NV], rate[2][3 * NV];
    mj_jac(m, d, j[0], j[1], point, robot_foot_body(robot, f));
    mj_jacDot(m, d, rate[0], rate[1], point, robot_foot_body(robot, f));
    for (int k = 0; k < 3; k++) {
        linear[k] = mju_dot(j[0] + NV * k, qacc, NV) + mju_dot(rate[0] + NV * k, d->qvel, NV);
        angular[k] = mju_dot(j[1] + NV * k, qacc, NV) + mju_dot(rate[1] + NV * k, d->qvel, NV);
    }
}

/* Standing on both feet at rest, the base where it should be, the DCM off its plan: the feet do not
 * accelerate, and the centre of mass does as the plan wants. With velocities, too, once the
 * impedances that answer them are off. */
TEST(torques_give_the_planned_motion) {
    for (int moving = 0; moving < 2; moving++) {
        MildError error = {0};
        const double b = 0.24, k = 3;
        BodyDef def = body_def_default();
        def.stance_damping = def.stance_turn_damping = def.turn_damping = 0;
        def.still_turn_damping = def.turn_stiffness = 0;
        Body *body = body_create(robot, &def, robot_effort(robot), &error);
        RobotSim *sim = robot_sim_create(robot, 0.001, &error);
        assert_non_null(body);
        assert_non_null(sim);
        RobotState start = some_state(moving ? 0.02 : 0);
        RobotVariation nominal = robot_variation_nominal();
        robot_sim_load(sim, &start, &nominal);
        WalkState state = {0};
        WalkTarget target = {.stands = {1, 1}, .share = {1, 1}, .swing = -1};
        double torque[ROBOT_JOINTS_MAX], qacc[NV], worst_foot = 0, worst_mass = 0;
        body_measure(body, sim, b, &state);
        const mjData *d = robot_sim_data(sim);
        double com[3];
        memcpy(com, d->subtree_com + 3, sizeof com);
        for (int i = 0; i < 3; i++) {
            target.point[i] = com[i] + 0.004 * (i - 1);
            target.dcm[i] = state.dcm[i] + 0.003 * (2 - i);
        }
        assert_int_equal(body_torque(body, &target, b, torque), 0);
        double wanted[WRENCH_SIZE], share[WALK_FEET][WRENCH_SIZE];
        body_wrenches(body, wanted, share);
        accelerate(sim, body, &state, torque, qacc);
        for (int f = 0; f < WALK_FEET; f++) {
            double linear[3], angular[3];
            foot_acceleration(sim, f, state.support[f], qacc, linear, angular);
            for (int i = 0; i < 3; i++) {
                worst_foot = fmax(worst_foot, fmax(fabs(linear[i]), fabs(angular[i])));
            }
        }
        for (int i = 0; i < 3; i++) {
            const double force = share[0][i] + share[1][i];
            const double got = force / robot_total_mass(robot) - (i == 2 ? GRAVITY : 0);
            const double plan = (com[i] - target.point[i]) / (b * b) -
                                (1 + k * b) / (b * b) * (state.dcm[i] - target.dcm[i]);
            worst_mass = fmax(worst_mass, fabs(got - plan));
        }
        printf("%s: feet accelerate by %.1e m/s^2, rad/s^2; centre of mass off by %.1e m/s^2\n",
               moving ? "moving" : "at rest", worst_foot, worst_mass);
        /* the program's own weights cost 1e-4 of a force; the inverse is damped */
        assert_true(worst_mass < 0.02);
        assert_true(worst_foot < 0.05);
        robot_sim_destroy(sim);
        body_destroy(body);
    }
}

/* The damping of a foot that stands is a force and a torque on that foot against its twist, through
 * the joints of its leg. */
TEST(moving_soles_are_damped) {
    MildError error = {0};
    double torque[2][ROBOT_JOINTS_MAX], worst = 0, largest = 0;
    BodyDef def = body_def_default();
    RobotSim *sim = robot_sim_create(robot, 0.001, &error);
    RobotVariation nominal = robot_variation_nominal();
    RobotState start = some_state(0.01);
    WalkState state = {0};
    for (int damped = 0; damped < 2; damped++) {
        def.stance_damping = damped ? 50 : 0;
        def.stance_turn_damping = damped ? 2 : 0;
        Body *body = body_create(robot, &def, robot_effort(robot), &error);
        WalkTarget target = {.stands = {1, 1}, .share = {1, 1}, .swing = -1};
        robot_sim_load(sim, &start, &nominal);
        body_measure(body, sim, 0.24, &state);
        memcpy(target.dcm, state.dcm, sizeof target.dcm);
        memcpy(target.point, state.dcm, sizeof target.point);
        assert_int_equal(body_torque(body, &target, 0.24, torque[damped]), 0);
        body_destroy(body);
    }
    const mjModel *m = robot_sim_model(sim);
    const mjData *d = robot_sim_data(sim);
    for (int i = 0; i < robot_joints(robot); i++) {
        const int f = robot_joint_foot(robot)[i], dof = robot_joint_dof(robot)[i];
        double j[6 * NV], wanted = 0;
        mj_jac(m, d, j, j + 3 * NV, state.support[f], robot_foot_body(robot, f));
        for (int k = 0; k < 6; k++) {
            wanted -= (k < 3 ? 50 : 2) * j[NV * k + dof] * mju_dot(j + NV * k, d->qvel, NV);
        }
        worst = fmax(worst, fabs(torque[1][i] - torque[0][i] - wanted));
        largest = fmax(largest, fabs(wanted));
    }
    printf("damping off by %.1e of %.2f N m\n", worst, largest);
    assert_true(worst < 1e-6 && largest > 0.5);
    robot_sim_destroy(sim);
}

/* A base turned about an axis is turned back about it; one that turns is braked. */
TEST(base_is_turned_back) {
    MildError error = {0};
    BodyDef def = body_def_default();
    Body *body = body_create(robot, &def, robot_effort(robot), &error);
    RobotSim *sim = robot_sim_create(robot, 0.001, &error);
    RobotVariation nominal = robot_variation_nominal();
    for (int axis = 0; axis < 3; axis++) {
        double wanted[2][WRENCH_SIZE], share[WALK_FEET][WRENCH_SIZE], torque[ROBOT_JOINTS_MAX];
        for (int turned = 0; turned < 2; turned++) {
            RobotState start = some_state(0);
            start.qpos[3] = cos(0.025 * turned);
            start.qpos[4 + axis] = sin(0.025 * turned);
            robot_sim_load(sim, &start, &nominal);
            WalkState state = {0};
            WalkTarget target = {.stands = {1, 1}, .share = {1, 1}, .swing = -1};
            body_measure(body, sim, 0.24, &state);
            memcpy(target.dcm, state.dcm, sizeof target.dcm);
            memcpy(target.point, state.dcm, sizeof target.point);
            body_torque(body, &target, 0.24, torque);
            body_wrenches(body, wanted[turned], share);
        }
        const double back = wanted[1][3 + axis] - wanted[0][3 + axis];
        printf("turned about %c: %.3f N m\n", "xyz"[axis], back);
        assert_true(fabs(back + def.turn_stiffness * 0.05) < 0.01 * def.turn_stiffness * 0.05);
    }
    robot_sim_destroy(sim);
    body_destroy(body);
}

/* ---- energy ---- */

/* A stand whose springs are at rest: both feet down, the centre of mass over their middle. */
typedef struct {
    Body *body;
    RobotSim *sim;
    MildGround *ground;
    MildTerrain terrain;
    RobotVariation variation;
    WalkTarget target;
    double b;     /* [s] of the DCM */
    double mass;  /* [kg] */
    size_t bytes; /* of the ground */
} Stand;

static void stand_step(Stand *stand) {
    WalkState state;
    double torque[ROBOT_JOINTS_MAX];
    body_measure(stand->body, stand->sim, stand->b, &state);
    assert_int_equal(body_torque(stand->body, &stand->target, stand->b, torque), 0);
    assert_int_equal(robot_sim_step(stand->sim, torque, NULL, &stand->terrain, stand->ground), 0);
}

/* [J] Kinetic energy of the robot, and what the springs hold that the impedances stand for: K = m
 * k/b of the centre of mass about p, and of the base about upright, whose torque is its stiffness
 * times the sine of the angle. From MuJoCo's state, not the controller's. */
static double stand_energy(const Stand *stand) {
    const mjModel *m = robot_sim_model(stand->sim);
    const mjData *d = robot_sim_data(stand->sim);
    const BodyDef def = body_def_default();
    const double *rotation = robot_sim_base_rotation(stand->sim);
    double momentum[NV], square = 0;
    mj_mulM(m, d, momentum, d->qvel);
    for (int k = 0; k < 3; k++) {
        const double off = d->subtree_com[3 + k] - stand->target.point[k];
        square += off * off;
    }
    return mju_dot(momentum, d->qvel, NV) / 2 + stand->mass * def.dcm_gain / stand->b * square / 2 +
           def.turn_stiffness * (3 - rotation[0] - rotation[4] - rotation[8]) / 2;
}

/* The velocity, in the engine's order, of a motion of the centre of mass and the base while the
 * feet rest: J nu = (motion, 0), by least squares on MuJoCo's own Jacobians. */
static void resting_feet(const Stand *stand, const double motion[6], double nu[NV]) {
    const mjModel *m = robot_sim_model(stand->sim);
    mjData *d = robot_sim_data(stand->sim);
    double j[NV][NV] = {{0}}, normal[NV][NV], right[NV];
    mj_jacSubtreeCom(m, d, j[0], 1);
    mj_jacBody(m, d, NULL, j[3], 1);
    for (int f = 0; f < WALK_FEET; f++) {
        mj_jacBody(m, d, j[6 + 6 * f], j[9 + 6 * f], robot_foot_body(robot, f));
    }
    for (int a = 0; a < NV; a++) {
        right[a] = 0;
        for (int t = 0; t < 6; t++) {
            right[a] += j[t][a] * motion[t];
        }
        for (int b = 0; b < NV; b++) {
            normal[a][b] = a == b ? 1e-9 : 0;
            for (int t = 0; t < NV; t++) {
                normal[a][b] += j[t][a] * j[t][b];
            }
        }
    }
    mju_cholFactor(normal[0], NV, 0);
    mju_cholSolve(nu, normal[0], right, NV);
}

/* On both feet on rigid ground or on foam60 until it rests. */
static void stand_open(Stand *stand, int rigid) {
    const BodyDef def = body_def_default();
    MildError error = {0};
    WalkState state;
    *stand = (Stand){.b = 0.254,
                     .terrain = kit_terrain("foam60"),
                     .variation = robot_variation_nominal(),
                     .mass = robot_total_mass(robot)};
    stand->variation.rigid = rigid;
    stand->body = body_create(robot, &def, robot_effort(robot), &error);
    stand->sim = robot_sim_create(robot, 0.0025, &error);
    stand->bytes = mild_ground_bytes(robot_soles(robot), robot_bodies(robot));
    assert_true(stand->body && stand->sim);
    stand->ground = kit_ground(robot);
    RobotState start = {.qpos = {0, 0, robot_stand_height(robot), 1, 0, 0, 0}};
    memcpy(start.qpos + 7, robot_default_pose(robot),
           (size_t)robot_joints(robot) * sizeof *start.qpos);
    robot_sim_load(stand->sim, &start, &stand->variation);
    body_measure(stand->body, stand->sim, stand->b, &state);
    const mjData *d = robot_sim_data(stand->sim);
    stand->target = (WalkTarget){.stands = {1, 1}, .share = {1, 1}, .swing = -1, .still = 1};
    for (int k = 0; k < 3; k++) {
        stand->target.point[k] =
            k < 2 ? (state.support[0][k] + state.support[1][k]) / 2 : d->subtree_com[5] - 0.01;
        stand->target.dcm[k] = stand->target.point[k];
    }
    for (int s = 0; s < 1600; s++) {
        stand_step(stand);
    }
}

static void stand_close(Stand *stand) {
    robot_sim_destroy(stand->sim);
    body_destroy(stand->body);
    free(stand->ground);
}

/* While the feet rest and the ground gives the wrench that is asked for, the motors' power is that
 * of the impedances, so that kinetic energy and springs fall by what the dampers take: they never
 * exceed what a kick brought. Soft ground lets the feet go, and may give back what it has stored
 * under them: less than the weight times the sinkage. */
TEST(motors_give_no_energy) {
    for (int rigid = 0; rigid < 2; rigid++) {
        Stand stand;
        RobotState rest, kicked;
        stand_open(&stand, rigid);
        const double weight = GRAVITY * stand.mass;
        const double sinks = rigid ? 0 : robot_sim_foot(stand.sim, 0)->result.depth_max;
        void *ground = malloc(stand.bytes);
        assert_non_null(ground);
        memcpy(ground, stand.ground, stand.bytes);
        robot_sim_store(stand.sim, &rest);
        assert_true(stand_energy(&stand) < 1e-6);
        for (int n = 0; n < 12; n++) {
            double motion[6] = {0}, nu[NV], most = 0, rise = 0;
            motion[n / 2] = (n % 2 ? -1 : 1) * (n / 2 < 3 ? 0.1 : 0.2);
            kicked = rest;
            memcpy(stand.ground, ground, stand.bytes);
            robot_sim_load(stand.sim, &rest, &stand.variation);
            resting_feet(&stand, motion, nu);
            for (int k = 0; k < 6; k++) {
                kicked.qvel[k] += nu[k];
            }
            for (int i = 0; i < robot_joints(robot); i++) {
                kicked.qvel[6 + i] += nu[robot_joint_dof(robot)[i]];
            }
            robot_sim_load(stand.sim, &kicked, &stand.variation);
            const double first = stand_energy(&stand);
            double last = first;
            for (int s = 0; s < 800; s++) {
                stand_step(&stand);
                const double now = stand_energy(&stand);
                rise = fmax(rise, now - last);
                most = fmax(most, now);
                last = now;
            }
            printf("%s, %s %c%c: %.4f J, at most %.4f afterwards, at last %.1e; rises by %.1e in a "
                   "step\n",
                   rigid ? "rigid" : "foam60", n / 2 < 3 ? "pushed" : "turned", "+-"[n % 2],
                   "xyz"[n / 2 % 3], first, most, last, rise);
            assert_true(most <= first + weight * sinks);
            assert_true(last < 0.05 * first);
            assert_true(!rigid || rise < 1e-3 * first); /* contacts of MuJoCo give way a little */
        }
        free(ground);
        stand_close(&stand);
    }
}

/* Outside of that condition, feet and all pushed sideways on foam, the motors put energy in before
 * the robot rests again (lab/paper/control/README.md). */
TEST(feet_that_move_are_another_matter) {
    Stand stand;
    RobotState state;
    stand_open(&stand, 0);
    robot_sim_store(stand.sim, &state);
    state.qvel[1] += 0.2;
    robot_sim_load(stand.sim, &state, &stand.variation);
    const double first = stand_energy(&stand);
    double most = 0;
    for (int s = 0; s < 2000; s++) {
        stand_step(&stand);
        most = fmax(most, stand_energy(&stand));
    }
    const double last = stand_energy(&stand);
    printf("foam60, feet pushed along +y: %.2f J, at most %.2f afterwards, at last %.1e\n", first,
           most, last);
    assert_true(most < 10 && last < 0.2 * first);
    stand_close(&stand);
}

/* ---- through the environment ---- */

typedef struct {
    double x, z_low, tilt, load;
    int fell; /* policy step, or 0 */
} Run;

static void see_nothing(void *context, const TaskEnv *env, const RobotSim *sim,
                        const double *torque) {
    (void)context, (void)env, (void)sim, (void)torque;
}

static Run run(const char *ground, double speed, double seconds) {
    MildError error = {0};
    TaskDef def = task_def_default();
    task_def_make_nominal(&def);
    def.randomize.initial_joint = def.randomize.initial_velocity = 0;
    def.episode = seconds + 1;
    Controller controller = {0};
    const ControllerDef wanted = {NULL, &def, robot, NULL, 1};
    assert_int_equal(controller_make("passivity", &wanted, &controller, &error), MILD_OK);
    RobotSim *sim = robot_sim_create(robot, def.physics_dt, &error);
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&def, robot));
    MildMaterial material = mild_material_default();
    const int rigid = strcmp(ground, "rigid") == 0;
    assert_true(rigid || mild_material_preset(ground, &material));
    MildTerrain terrain = mild_terrain_uniform(&material);
    EnvsView none = {0};
    ControllerRow row = {&controller, 0};
    TaskDrive drive = controller_drive(&row);
    TaskCallback callback = {see_nothing, NULL, &drive};
    Run out = {.z_low = 1e9};
    task_env_init(env, &def, robot, 1, 0);
    env->command_frozen = 1;
    memset(env->command, 0, sizeof env->command);
    env->command[0] = speed;
    task_env_reset_on(env, &def, robot, sim, &terrain, rigid, &none);
    for (int t = 0; !out.fell && t < (int)(seconds / TASK_PERIOD); t++) {
        float action[ROBOT_JOINTS_MAX];
        controller.act(controller.self, 1, &env, action);
        if (task_env_step(env, &def, robot, sim, action, 0, &none, &callback).done) {
            out.fell = t + 1;
        }
        out.z_low = fmin(out.z_low, env->robot.qpos[2]);
        out.tilt = fmax(out.tilt, 1 - robot_sim_base_rotation(sim)[8]);
    }
    out.x = env->robot.qpos[0];
    out.load = (robot_sim_foot(sim, 0)->force[2] + robot_sim_foot(sim, 1)->force[2]) /
               (robot_total_mass(robot) * GRAVITY);
    printf("%s at %.1f m/s: x %.3f m, base above %.3f m, 1 - cos(tilt) %.4f, load %.4f%s\n", ground,
           speed, out.x, out.z_low, out.tilt, out.load, out.fell ? ", fell" : "");
    controller_destroy(&controller);
    robot_sim_destroy(sim);
    free(env);
    return out;
}

TEST(stands) {
    static const char *const grounds[] = {"rigid", "foam60"};
    for (int g = 0; g < 2; g++) {
        Run out = run(grounds[g], 0, 10);
        assert_int_equal(out.fell, 0);
        assert_true(fabs(out.x) < 0.06);
        assert_true(fabs(out.load - 1) < 0.01);
        assert_true(out.tilt < 0.01);
    }
}

/* The command rises by 0.3 m/s^2 after the first double support of 0.8 s: in 5 s the robot comes
 * about 0.4 (5 - 0.8 - 0.67) m far. */
TEST(walks) {
    Run out = run("rigid", 0.4, 5);
    assert_int_equal(out.fell, 0);
    assert_true(out.x > 1.3 && out.x < 1.8);
    assert_true(out.z_low > 0.6 && out.tilt < 0.05);
}

TEST(refuses_a_quadruped) {
    MildError error = {0};
    Robot *go1 = kit_robot_named("go1");
    TaskDef def = task_def_default();
    Controller controller = {0};
    const ControllerDef wanted = {NULL, &def, go1, NULL, 1};
    assert_int_equal(controller_make("passivity", &wanted, &controller, &error),
                     MILD_ERROR_ARGUMENT);
    assert_error(&error, MILD_ERROR_ARGUMENT, "passivity go1 --controller");
    assert_null(controller.self);
    robot_destroy(go1);
}

TEST_MAIN(setup, teardown)
