/* A made-up robot whose joints stand in another order in robot.ini than in the MJCF, with a waist
 * that moves both legs, a neck that moves none, one flat and one round foot, shells of every kind:
 * what the code finds out about it, its feet against the engine's Jacobians, its step against the
 * engine's. And what makes it refused. */
#include <mujoco/mujoco.h>

#include "base/random.h"
#include "robot/description.h"
#include "robots.h"

enum { JOINTS = 7, NQ = 14, NV = 13, FEET = 2, FLAT = 0, ROUND = 1, ROWS = 12 };

/* Engine's order: waist, hip_l, knee_l, ankle_l, hip_r, knee_r, neck. */
static const char mjcf[] =
    "<mujoco><compiler angle='radian' autolimits='true'/><option gravity='0 0 -10'/>\n"
    "<default><joint actuatorfrcrange='-50 50' range='-2 2' armature='0.02'/></default>\n"
    "<worldbody><light pos='0 0 3'/><body name='torso' pos='0 0 1'><freejoint/>\n"
    "<geom name='chest' type='box' size='0.1 0.15 0.2' mass='10' pos='0.01 0 0.2'\n"
    " euler='0.2 0.3 0.4'/>\n"
    "<body name='pelvis' pos='0 0 -0.1'><joint name='waist' axis='0 0 1'/>\n"
    "<geom name='belt' type='sphere' size='0.08' mass='3' pos='0 0.02 0'/>\n"
    "<body name='thigh_l' pos='0.02 0.1 0'><joint name='hip_l' axis='0 1 0'/>\n"
    "<geom name='bone' type='capsule' size='0.04 0.15' mass='2' pos='0 0 -0.15'/>\n"
    "<body name='shank_l' pos='0 0 -0.3'><joint name='knee_l' axis='0 1 0'/>\n"
    "<geom type='box' size='0.03 0.03 0.15' mass='1.5' pos='0 0 -0.15'/>\n"
    "<body name='foot_l' pos='0 0 -0.3'><joint name='ankle_l' axis='0 1 0'/>\n"
    "<geom type='box' size='0.1 0.05 0.02' mass='0.5' pos='0.02 0 -0.03'/></body></body></body>\n"
    "<body name='thigh_r' pos='0.02 -0.1 0'><joint name='hip_r' axis='0 1 0' range='-1.5 1.4'/>\n"
    "<geom type='capsule' size='0.04 0.15' mass='2.1' pos='0 0 -0.15'/>\n"
    "<body name='shank_r' pos='0 0 -0.3'><joint name='knee_r' axis='0 1 0'\n"
    " actuatorfrcrange='-60 60'/>\n"
    "<geom type='box' size='0.03 0.03 0.15' mass='1.6' pos='0 0 -0.15'/>\n"
    "<body name='toe_r' pos='0 0 -0.3'><geom type='sphere' size='0.03' mass='0.2'/></body>\n"
    "</body></body></body>\n"
    "<body name='head' pos='0 0 0.5'><joint name='neck' axis='1 0 0'/>\n"
    "<geom type='sphere' size='0.1' mass='2'/></body></body></worldbody>\n"
    "<actuator><motor joint='waist'/></actuator>\n"
    "<custom><numeric name='one' data='1 2'/><numeric name='two' data='3'/></custom>\n"
    "<keyframe><key name='up'/><key name='down'/></keyframe></mujoco>\n";

static const char ini[] =
    "[robot]\nname = walker\nmodel = walker.xml\nbase = torso\nshells = chest belt bone\n"
    "height = 0.6\naction_scale = 0.3\nfeet_range = 0.1 0.3\nknee_range = 0.15 0.35\n"
    "feet_least = 0.07\nknee_least = 0.08\nfoot_force = 300\nassist = 100 10 50 20\n"
    "[joints]\nnames = neck knee_r hip_r ankle_l knee_l hip_l waist\n"
    "mirror = neck knee_l hip_l ankle_l knee_r hip_r waist\n"
    "mirror_sign = -1 1 1 1 1 1 -1\npose = 0 0.5 -0.25 -0.2 0.4 -0.2 0\n"
    "kp = 1 2 3 4 5 6 7\nkd = 0.1 0.2 0.3 0.4 0.5 0.6 0.7\neffort = 0 0 33 0 0 0.5 0\n"
    "speed = 1 2 3 4 5 6 7\nswing = 0 2 -1 -1 2 -1 0\nstill = 1 0 0 0 0 0 1\n"
    "[foot.flat]\nbody = foot_l\nknee = shank_l\nmirror = ball\nankle = ankle_l\noffset = 0.1\n"
    "shape = outline\noutline = -0.08 -0.04 0.12 -0.06 0.12 0.04 -0.08 0.04\nz = -0.05\n"
    "pitch = 0.02\ncorners = -0.07 -0.03 -0.045 0.11 -0.05 -0.045 0.11 0.03 -0.045\n"
    "[foot.ball]\nbody = toe_r\nknee = shank_r\nmirror = flat\noffset = 0.6\nshape = round\n"
    "center = 0.01 0.02 -0.03\nradius = 0.04\npitch = 0.01\n";

/* robot.ini's joint i in the engine. */
static const int dof_of[JOINTS] = {12, 11, 10, 9, 8, 7, 6};

static Robot *robot;
static RobotSim *sim; /* at 1 ms */
static MildGround *ground;
static RobotVariation nominal;

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = kit_robot_of("walker.xml", mjcf, ini, &error);
    expect_good(robot && !error.text[0], &error);
    sim = robot_sim_create(robot, 0.001, &error);
    expect_good(sim != NULL, &error);
    ground = kit_ground(robot);
    nominal = robot_variation_nominal();
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    free(ground);
    robot_sim_destroy(sim);
    robot_destroy(robot);
    return 0;
}

/* ---- what is known of it ---- */

/* What is found out about the joints, and what the table of the task has of robot.ini. */
TEST(test_joints) {
    const RobotTable *table = robot_table(robot);
    const int foot[JOINTS] = {-1, ROUND, ROUND, FLAT, FLAT, FLAT, -1};
    const int image[JOINTS] = {0, 4, 5, 3, 1, 2, 6};
    const double effort[JOINTS] = {50, 60, 33, 50, 50, 0.5, 50};
    const double pose[JOINTS] = {0, 0.5, -0.25, -0.2, 0.4, -0.2, 0};
    const double swing[JOINTS] = {0, 2, -1, -1, 2, -1, 0};
    for (int i = 0; i < JOINTS; i++) {
        assert_int_equal(robot_joint_dof(robot)[i], dof_of[i]);
        assert_int_equal(robot_joint_foot(robot)[i], foot[i]);
        assert_int_equal(robot_mirror_joint(robot)[i], image[i]);
        expect_entry("low", i, robot_joint_low(robot)[i], i == 2 ? -1.5 : -2, 0);
        expect_entry("high", i, robot_joint_high(robot)[i], i == 2 ? 1.4 : 2, 0);
        expect_entry("effort", i, table->effort[i], effort[i], 0);
        expect_entry("pose", i, table->default_pose[i], pose[i], 0);
        expect_entry("speed", i, table->speed[i], i + 1, 0);
        expect_entry("swing", i, table->swing[i], swing[i], 0);
        expect_entry("still", i, table->still[i], i == 0 || i == JOINTS - 1, 0);
    }
}

TEST(test_feet_and_body) {
    for (int f = 0; f < FEET; f++) {
        expect_entry("offset", f, robot_table(robot)->gait_offset[f], f ? 0.6 : 0.1, 0);
        expect_entry("feet_range", f, robot_table(robot)->feet_range[f], f ? 0.3 : 0.1, 0);
        expect_entry("knee_range", f, robot_table(robot)->knee_range[f], f ? 0.35 : 0.15, 0);
    }
    assert_int_equal(robot_ankle(robot, FLAT), 3);
    assert_int_equal(robot_ankle(robot, ROUND), -1);
    expect_entry("shift", 0, robot_mirror_shift(robot), 0.5, 1e-15);
    expect_entry("mass", 0, robot_total_mass(robot), 22.9, 1e-9);
    expect_entry("load of a foot", 0, robot_foot_load(robot), 22.9 * 10 / 2, 1e-9);
    expect_entry("height", 0, robot_nominal_height(robot), 0.6, 0);
    expect_entry("action_scale", 0, robot_table(robot)->action_scale, 0.3, 0);
    expect_entry("foot_force", 0, robot_table(robot)->foot_force, 300, 0);
    expect_entry("least", 0, robot_table(robot)->feet_least, 0.07, 0);
    expect_entry("least", 1, robot_table(robot)->knee_least, 0.08, 0);
    expect_entry("assist", 3, robot_table(robot)->assist[3], 20, 0);
    expect_entry("assist", 0, robot_table(robot)->assist[0], 100, 0);
}

/* Base above the lower of the soles in the default pose: the flat one hangs 0.1 + 0.3 cos 0.2 twice
 * + 0.05 below; the ball's leg is bent by 0.25 each way, its centre off the shank's line. */
TEST(test_stand_height) {
    double flat = 0.1 + 0.6 * cos(0.2) + 0.05;
    double ball = 0.1 + 0.6 * cos(0.25) + 0.03 * cos(0.25) + 0.01 * sin(0.25) + 0.04;
    expect_entry("stand height", 0, robot_stand_height(robot), fmax(flat, ball), 1e-12);
    expect_entry("lowest sole", 0,
                 fmin(robot_sim_foot(sim, 0)->sole_height, robot_sim_foot(sim, 1)->sole_height), 0,
                 1e-12);
    expect_entry("flat", 0, robot_sim_foot(sim, FLAT)->sole_height,
                 robot_stand_height(robot) - flat, 1e-12);
    expect_entry("ball", 0, robot_sim_foot(sim, ROUND)->sole_height,
                 robot_stand_height(robot) - ball, 1e-12);
}

/* A round foot is a disc of the sphere's cross section; rasters whatever the model. */
TEST(test_soles) {
    const MildSole *const *soles = robot_soles(robot), *const *rasters = robot_rasters(robot);
    assert_ptr_equal(soles[0], rasters[0]);
    assert_true(mild_sole_elements(soles[FLAT]) > 30);
    double area = mild_sole_elements(soles[ROUND]) * mild_sole_pitch(soles[ROUND]) *
                  mild_sole_pitch(soles[ROUND]);
    expect_entry("area of the disc", 0, area, 3.14159 * 0.04 * 0.04, 0.0007);
    for (int i = 0; i < mild_sole_elements(soles[ROUND]); i++) {
        double x = mild_sole_x(soles[ROUND])[i], y = mild_sole_y(soles[ROUND])[i];
        assert_true(hypot(x, y) < 0.041);
    }
    expect_entry("the disc's plane", 0, mild_sole_z(soles[ROUND]), 0, 0);
    expect_entry("the sole's plane", 0, mild_sole_z(soles[FLAT]), -0.05, 0);
    robot_set_model(robot, MILD_MODEL_CON_CONE);
    assert_int_equal(mild_sole_elements(robot_soles(robot)[FLAT]), 1);
    assert_int_equal(mild_sole_elements(robot_soles(robot)[ROUND]), 1);
    assert_ptr_equal(robot_rasters(robot)[0], rasters[0]);
    robot_set_model(robot, MILD_MODEL_MILD);
    assert_ptr_equal(robot_soles(robot)[0], rasters[0]);
}

static void check_rigid_ground(const mjModel *m) {
    const double corner[4][4] = {{-0.07, -0.03, -0.045, 0.005},
                                 {0.11, -0.05, -0.045, 0.005},
                                 {0.11, 0.03, -0.045, 0.005},
                                 {0.01, 0.02, -0.03, 0.04}};
    const double friction[5] = {0.8, 0.8, 0.005, 0.0001, 0.0001};
    int floor = mj_name2id(m, mjOBJ_GEOM, "floor");
    assert_int_equal(m->geom_type[floor], mjGEOM_PLANE);
    int c = 0;
    for (int p = 0; p < m->npair; p++) {
        int geom = m->pair_geom2[p];
        if (m->pair_margin[p] < 0) {
            continue; /* of a shell */
        }
        assert_int_equal(m->pair_geom1[p], floor);
        assert_int_equal(m->pair_dim[p], 3);
        assert_int_equal(m->geom_bodyid[geom], robot_foot_body(robot, c == 3));
        assert_int_equal(m->geom_contype[geom] + m->geom_conaffinity[geom], 0);
        assert_int_equal(m->geom_type[geom], mjGEOM_SPHERE);
        expect_entry("radius", c, m->geom_size[3 * geom], corner[c][3], 0);
        for (int k = 0; k < 3; k++) {
            expect_entry("corner", c, m->geom_pos[3 * geom + k], corner[c][k], 1e-12);
        }
        for (int k = 0; k < 5; k++) {
            expect_entry("friction", k, m->pair_friction[5 * p + k], friction[k], 1e-15);
        }
        c++;
    }
    assert_int_equal(c, 4);
}

/* What a step does not need is not in its model: one plane, the feet's corners and one geom of each
 * body with shells remain. */
TEST(test_models) {
    const mjModel *m = robot_sim_model(sim), *whole = robot_visual_model(robot);
    assert_int_equal(whole->ngeom, 9);
    assert_int_equal(whole->nu, 1);
    assert_int_equal(m->ngeom, 5 + 3);
    assert_int_equal(m->npair, 4 + 3);
    assert_int_equal(m->nu, 0);
    assert_int_equal(m->nlight, 0);
    assert_int_equal(m->nv, NV);
    assert_int_equal(m->nbody, whole->nbody);
    for (int b = 0; b < m->nbody; b++) { /* inertia of the geoms that went */
        expect_entry("mass", b, m->body_mass[b], whole->body_mass[b], 1e-12);
        for (int k = 0; k < 3; k++) {
            expect_entry("inertia", b, m->body_inertia[3 * b + k], whole->body_inertia[3 * b + k],
                         1e-12);
            expect_entry("centre", b, m->body_ipos[3 * b + k], whole->body_ipos[3 * b + k], 1e-12);
        }
        for (int k = 0; k < 4; k++) {
            expect_entry("axes", b, m->body_iquat[4 * b + k], whole->body_iquat[4 * b + k], 1e-12);
        }
    }
    check_rigid_ground(m);
}

/* ---- against the engine ---- */

static RobotState draw_state(uint32_t draw, double height) {
    Random r = random_at(51, draw, 0);
    RobotState state = {.qpos = {random_uniform(&r, -1, 1), random_uniform(&r, -1, 1), height}};
    double angle[3] = {random_uniform(&r, -0.5, 0.5), random_uniform(&r, -0.5, 0.5),
                       random_uniform(&r, -3, 3)};
    mju_euler2Quat(state.qpos + 3, angle, "XYZ");
    for (int i = 0; i < JOINTS; i++) {
        state.qpos[7 + i] = random_uniform(&r, -1, 1);
    }
    for (int i = 0; i < NV; i++) {
        state.qvel[i] = random_uniform(&r, -1, 1);
    }
    return state;
}

/* The engine's data at a state, joints put where they belong by name. */
static mjData *engine_at(const mjModel *m, const RobotState *state) {
    mjData *d = mj_makeData(m);
    memcpy(d->qpos, state->qpos, 7 * sizeof(double));
    memcpy(d->qvel, state->qvel, 6 * sizeof(double));
    for (int i = 0; i < JOINTS; i++) {
        int id = mj_name2id(m, mjOBJ_JOINT, robot_joint_name(robot, i));
        d->qpos[m->jnt_qposadr[id]] = state->qpos[7 + i];
        d->qvel[m->jnt_dofadr[id]] = state->qvel[6 + i];
    }
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d);
    return d;
}

/* [m] Ankle of the flat foot, lowest point of the round one. */
static void reference_point(const mjModel *m, const mjData *d, int f, double point[3]) {
    static const double center[3] = {0.01, 0.02, -0.03};
    int body = mj_name2id(m, mjOBJ_BODY, f == ROUND ? "toe_r" : "foot_l");
    memcpy(point, d->xpos + 3 * body, 3 * sizeof *point);
    if (f == ROUND) {
        double arm[3];
        mju_mulMatVec3(arm, d->xmat + 9 * body, center);
        mju_addTo3(point, arm);
        point[2] -= 0.04;
    }
}

/* Twist of both feet by velocity; a round foot has no angular part. */
static void dense_jacobian(const mjModel *m, const mjData *d, double j[ROWS * NV]) {
    memset(j, 0, sizeof(double) * ROWS * NV);
    for (int f = 0; f < FEET; f++) {
        double point[3], *rows = j + 6 * f * NV;
        int body = mj_name2id(m, mjOBJ_BODY, f == ROUND ? "toe_r" : "foot_l");
        reference_point(m, d, f, point);
        mj_jac(m, d, rows, f == ROUND ? NULL : rows + 3 * NV, point, body);
    }
}

/* Moves `middle` from the ankle to the middle of the flat sole; returns its lowest point above the
 * ground [m]. */
static double measure_flat(const mjData *d, const MildTerrain *terrain, const double point[3],
                           double middle[3]) {
    static const double outline[4][3] = {
        {-0.08, -0.04, -0.05}, {0.12, -0.06, -0.05}, {0.12, 0.04, -0.05}, {-0.08, 0.04, -0.05}};
    static const double center[3] = {0.02, -0.01, -0.05};
    const double *turn = d->xmat + 9 * robot_foot_body(robot, FLAT);
    double arm[3], lowest = 1e9;
    mju_mulMatVec3(arm, turn, center);
    mju_addTo3(middle, arm);
    for (int c = 0; c < 4; c++) {
        mju_mulMatVec3(arm, turn, outline[c]);
        mju_addTo3(arm, point);
        lowest = fmin(lowest, arm[2] - mild_terrain_height_at(terrain, arm[0], arm[1]));
    }
    return lowest;
}

static MildMap *waves(void) {
    MildMapDef def = mild_map_def_default();
    MildError error = {0};
    def.kind = MILD_MAP_WAVES;
    def.amplitude = 0.2;
    MildMap *map = mild_map_create(&def, &error);
    assert_non_null(map);
    return map;
}

/* map: NULL for level ground. */
static MildTerrain sunk(MildMap *map) {
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    terrain.map = map;
    terrain.height = -0.2;
    return terrain;
}

/* The feet of a workspace at a state, its clearance above the ground already measured. Returns the
 * lowest point of a sole [m]. */
static double check_feet(const RobotState *state, const MildTerrain *terrain) {
    const mjModel *m = robot_sim_model(sim);
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    mjData *d = engine_at(m, state);
    double j[ROWS * NV], twist[ROWS], least = 1e9;
    dense_jacobian(m, d, j);
    mju_mulMatVec(twist, j, d->qvel, ROWS, NV);
    for (int f = 0; f < FEET; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        const double *turn = f == ROUND ? identity : d->xmat + 9 * robot_foot_body(robot, f);
        double point[3], middle[3];
        reference_point(m, d, f, point);
        memcpy(middle, point, sizeof middle);
        const double lowest = f == FLAT
                                  ? measure_flat(d, terrain, point, middle)
                                  : point[2] - mild_terrain_height_at(terrain, point[0], point[1]);
        expect_entry("height", f, foot->sole_height, lowest, 1e-12);
        least = fmin(least, lowest);
        for (int k = 0; k < 9; k++) {
            expect_entry("rotation", k, foot->rotation[k], turn[k], 1e-12);
        }
        for (int k = 0; k < 3; k++) {
            expect_entry("reference", k, foot->position[k], point[k], 1e-12);
            expect_entry("middle", k, foot->sole_center[k], middle[k], 1e-12);
        }
        for (int k = 0; k < 6; k++) {
            expect_entry("twist", k, foot->velocity[k], twist[6 * f + k], 1e-12);
        }
    }
    mj_deleteData(d);
    return least;
}

/* After a load, and after a step through the air. */
TEST(test_feet) {
    MildMap *map = waves();
    for (uint32_t draw = 0; draw < 20; draw++) {
        const MildTerrain terrain = sunk(draw % 2 ? map : NULL);
        const double torque[JOINTS] = {0};
        RobotState state = draw_state(draw, 1);
        robot_sim_load(sim, &state, &nominal);
        const double clearance = robot_sim_sole_clearance(sim, &terrain);
        expect_entry("clearance", 0, clearance, check_feet(&state, &terrain), 1e-12);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        robot_sim_store(sim, &state);
        check_feet(&state, &terrain);
    }
    mild_map_destroy(map);
}

/* A ground that answers each step with given wrenches and keeps what the step asked of it: the
 * robot's own part of a step, seen from the ground. */
typedef struct {
    double wrench[ROBOT_FEET_MAX][6]; /* force, torque */
    int feet;
    double inverse_inertia[36 * ROBOT_FEET_MAX * ROBOT_FEET_MAX]; /* A of the last step */
    double free_velocity[6 * ROBOT_FEET_MAX];                     /* V_free */
} Given;

static int given_solve(void *self, const MildTerrain *terrain, MildGround *ground,
                       const MildContactInput *in, MildContactResult *result) {
    (void)terrain;
    (void)ground;
    Given *given = self;
    const size_t rows = 6 * (size_t)in->feet;
    given->feet = in->feet;
    memcpy(given->inverse_inertia, in->inverse_inertia, rows * rows * sizeof(double));
    memcpy(given->free_velocity, in->free_velocity, rows * sizeof(double));
    for (int f = 0; f < in->feet; f++) {
        memcpy(result->foot[f].force, given->wrench[f], 3 * sizeof(double));
        memcpy(result->foot[f].torque, given->wrench[f] + 3, 3 * sizeof(double));
    }
    return 0;
}

/* A step without torques from a state, on this ground. Returns whether it diverged. */
static int given_step(Given *given, const RobotState *state) {
    static const double limp[ROBOT_JOINTS_MAX];
    const MildMaterial material = mild_material_default();
    const MildTerrain terrain = mild_terrain_uniform(&material);
    const RobotGround ground = {given_solve, given};
    robot_sim_load(sim, state, &nominal);
    robot_sim_set_ground(sim, &ground);
    const int bad = robot_sim_step(sim, limp, NULL, &terrain, NULL);
    robot_sim_set_ground(sim, NULL);
    return bad;
}

/* What wrenches of the ground do, after a step without. j: J of both feet, solved: its rows times
 * M^-1. */
static void check_wrench(const RobotState *state, const double *j, const double *solved) {
    Given given = {.feet = 0};
    const mjData *d = robot_sim_data(sim);
    double by_force[NV], by_change[NV], force[NV], rate[NV], sum[ROWS];
    assert_int_equal(given_step(&given, state), 0);
    memcpy(force, d->qfrc_smooth, sizeof force);
    memcpy(rate, d->qvel, sizeof rate);
    mju_mulMatVec(sum, j, rate, ROWS, NV);
    for (int r = 0; r < ROWS; r++) {
        expect_entry("twist to come", r, given.free_velocity[r], sum[r], 1e-11);
    }
    for (int r = 0; r < ROWS; r++) {
        given.wrench[r / 6][r % 6] = sin(1.0 + r);
    }
    assert_int_equal(given_step(&given, state), 0);
    mju_mulMatTVec(by_force, j, given.wrench[0], ROWS, NV);
    mju_mulMatTVec(by_change, solved, given.wrench[0], ROWS, NV);
    for (int i = 0; i < NV; i++) {
        expect_entry("force", i, d->qfrc_smooth[i] - force[i], by_force[i], 1e-11);
        expect_entry("acceleration", i, (d->qvel[i] - rate[i]) / 0.001, by_change[i],
                     1e-9 * (1 + fabs(by_change[i])));
    }
}

TEST(test_map) {
    const mjModel *m = robot_sim_model(sim);
    Given given = {.feet = 0};
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = draw_state(draw, 1);
        mjData *d = engine_at(m, &state);
        assert_int_equal(given_step(&given, &state), 0);
        double j[ROWS * NV], solved[ROWS * NV], wanted[ROWS * ROWS];
        dense_jacobian(m, d, j);
        mj_solveM(m, d, solved, j, ROWS);
        mju_mulMatMatT(wanted, j, solved, ROWS, NV, ROWS);
        for (int i = 0; i < ROWS * ROWS; i++) {
            expect_entry("inverse inertia", i, given.inverse_inertia[i], wanted[i],
                         1e-10 * (1 + fabs(wanted[i])));
        }
        check_wrench(&state, j, solved);
        mj_deleteData(d);
    }
}

/* In the air on soft ground, and falling onto rigid ground, pushed, with a joint beyond its limit:
 * the engine's own step, under xfrc_applied. */
static void step_is_the_engines(int rigid, double height, int steps) {
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = rigid;
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    const mjModel *m = robot_sim_model(sim);
    const double push[6] = {30, -45, 40, -5, 6, -7};
    const int base = mj_name2id(m, mjOBJ_BODY, "torso");
    int contacts[FEET] = {0};
    for (uint32_t draw = 0; draw < 8; draw++) {
        RobotState state = draw_state(draw, 1), after;
        double torque[JOINTS];
        const int beyond = (int)draw % JOINTS;
        state.qpos[7 + beyond] = robot_joint_high(robot)[beyond] + 0.01;
        robot_sim_load(sim, &state, &variation);
        state.qpos[2] += height - robot_sim_sole_clearance(sim, &terrain);
        robot_sim_load(sim, &state, &variation);
        mjData *d = engine_at(m, &state);
        for (int i = 0; i < JOINTS; i++) {
            torque[i] = 2 * (i - 3);
            d->qfrc_applied[dof_of[i]] = torque[i];
        }
        memcpy(d->xfrc_applied + 6 * base, push, sizeof push);
        for (int t = 0; t < steps; t++) {
            mj_step(m, d);
            assert_int_equal(robot_sim_step(sim, torque, push, &terrain, ground), 0);
            contacts[0] += robot_sim_contact(sim)->foot[0].contacts > 0;
            contacts[1] += robot_sim_contact(sim)->foot[1].contacts > 0;
        }
        robot_sim_store(sim, &after);
        for (int i = 0; i < JOINTS; i++) {
            expect_entry("joint", i, after.qpos[7 + i], d->qpos[dof_of[i] + 1], 1e-9);
            expect_entry("its speed", i, after.qvel[6 + i], d->qvel[dof_of[i]], 1e-9);
        }
        for (int i = 0; i < 7; i++) {
            expect_entry("base", i, after.qpos[i], d->qpos[i], 1e-9);
        }
        for (int i = 0; i < 6; i++) {
            expect_entry("its twist", i, after.qvel[i], d->qvel[i], 1e-9);
        }
        mj_deleteData(d);
    }
    assert_true(rigid ? contacts[0] > 20 && contacts[1] > 20 : contacts[0] + contacts[1] == 0);
}

TEST(test_steps) {
    step_is_the_engines(0, 0.5, 100);
    step_is_the_engines(1, 0.01, 300);
}

/* ---- shells ---- */

/* [m] Lowest point of a geom. */
static double lowest_of(const mjModel *m, const mjData *d, const char *name, double at[3]) {
    int geom = mj_name2id(m, mjOBJ_GEOM, name);
    const double *size = m->geom_size + 3 * geom, *turn = d->geom_xmat + 9 * geom;
    memcpy(at, d->geom_xpos + 3 * geom, 3 * sizeof *at);
    if (m->geom_type[geom] == mjGEOM_SPHERE) {
        return at[2] - size[0];
    }
    if (m->geom_type[geom] == mjGEOM_CAPSULE) {
        return at[2] - size[0] - fabs(turn[8]) * size[1];
    }
    return at[2] - fabs(turn[6]) * size[0] - fabs(turn[7]) * size[1] - fabs(turn[8]) * size[2];
}

TEST(test_shells) {
    static const char *const names[3] = {"chest", "belt", "bone"};
    MildMap *map = waves();
    const MildTerrain terrain = sunk(map);
    const mjModel *m = robot_visual_model(robot);
    int least_of[3] = {0};
    for (uint32_t draw = 0; draw < 100; draw++) {
        RobotState state = draw_state(draw, 1);
        Random r = random_at(52, draw, 0);
        for (int i = 3; i < 7; i++) {
            state.qpos[i] = random_normal(&r);
        }
        mju_normalize4(state.qpos + 3);
        robot_sim_load(sim, &state, &nominal);
        mjData *d = engine_at(m, &state);
        double least = 1e9;
        int which = 0;
        for (int s = 0; s < 3; s++) {
            double at[3], low = lowest_of(m, d, names[s], at);
            low -= mild_terrain_height_at(&terrain, at[0], at[1]);
            which = low < least ? s : which;
            least = fmin(least, low);
        }
        least_of[which]++;
        expect_entry("clearance", (int)draw, robot_sim_body_clearance(sim, &terrain), least, 1e-9);
        mj_deleteData(d);
    }
    assert_true(least_of[0] > 5 && least_of[1] > 5 && least_of[2] > 5);
    mild_map_destroy(map);
}

/* ---- refusals ---- */

static void expect_spoilt(double *number, const char *names) {
    MildError error = {0};
    double kept = *number;
    *number = INFINITY;
    assert_int_equal(robot_check_model(robot->visual, "x.xml", &error), MILD_ERROR_RANGE);
    *number = kept;
    assert_error(&error, MILD_ERROR_RANGE, names);
}

/* Numbers of the file that no body or joint has. */
TEST(test_other_numbers) {
    mjModel *m = robot->visual;
    assert_true(m->nnumeric == 2 && m->nkey == 2);
    assert_int_equal(robot_check_model(m, "x.xml", NULL), MILD_OK);
    expect_spoilt(m->numeric_data, "x.xml numeric one data inf");
    expect_spoilt(m->numeric_data + 1, "x.xml numeric one data inf");
    expect_spoilt(m->numeric_data + 2, "x.xml numeric two data inf");
    expect_spoilt(m->key_qpos, "x.xml key up qpos inf");
    expect_spoilt(m->key_qpos + NQ - 1, "x.xml key up qpos inf");
    expect_spoilt(m->key_qpos + NQ, "x.xml key down qpos inf");
    expect_spoilt(m->key_qpos + 2 * NQ - 1, "x.xml key down qpos inf");
}

/* With `from` written as `to` in one of the two texts: an error of that status; MILD_OK:
 * accepted. */
typedef struct {
    const char *from, *to;
    MildStatus status;
    const char *names;
} Change;

static const Change changes[] = {
    /* bodies and joints that the two texts name */
    {"<freejoint/>", "<joint axis='0 0 1'/>", MILD_ERROR_FORMAT, "walker.xml torso"},
    {"base = torso", "base = pelvis", MILD_ERROR_FORMAT, "walker.xml pelvis"},
    {"base = torso", "base = chest", MILD_ERROR_FORMAT, "walker.xml chest [robot] base"},
    {"body = foot_l", "body = foot", MILD_ERROR_FORMAT, "walker.xml foot [foot.flat]"},
    {"knee = shank_l", "knee = none", MILD_ERROR_FORMAT, "walker.xml none [foot.flat]"},
    {"body = toe_r", "body = foot_l", MILD_ERROR_FORMAT, "robot.ini flat ball"},
    {"body = toe_r", "body = torso", MILD_ERROR_FORMAT, "walker.xml torso [foot.ball]"},
    {"body = toe_r", "body = world", MILD_ERROR_FORMAT, "walker.xml world [foot.ball]"},
    {"body = toe_r", "body = pelvis", MILD_ERROR_FORMAT, "belt shells covers ball"},
    {"body = toe_r\nknee = shank_r\nmirror = flat\noffset = 0.6\nshape = round\n"
     "center = 0.01 0.02 -0.03",
     "body = pelvis\nknee = shank_r\nmirror = flat\noffset = 0.6\nshape = round\n"
     "center = 0 0 -0.2",
     MILD_OK, NULL}, /* one joint is enough */
    {"joint name='neck'", "joint name='nek'", MILD_ERROR_FORMAT, "walker.xml neck [joints] names"},
    {"<body name='head' pos='0 0 0.5'>",
     "<body name='head' pos='0 0 0.5'><joint name='nod' axis='0 1 0'/>", MILD_ERROR_FORMAT,
     "walker.xml nod [joints] names"},
    /* ranges, torques, poses */
    {"name='ankle_l'", "name='ankle_l' range='-3.2 3.2'", MILD_ERROR_FORMAT,
     "walker.xml ankle_l [foot.flat]"},
    {"name='ankle_l'", "name='ankle_l' range='-3.1 3.1'", MILD_OK, NULL},
    {"name='knee_r'", "name='knee_r' range='-4 4'", MILD_OK, NULL}, /* above a round foot */
    {"range='-2 2' ", "", MILD_ERROR_FORMAT, "walker.xml range actuatorfrcrange [joints] effort"},
    {"<default><joint actuatorfrcrange='-50 50'", "<default><joint", MILD_ERROR_FORMAT,
     "walker.xml range actuatorfrcrange [joints] effort"},
    {"effort = 0 0 33 0 0 0.5 0", "effort = 1 1 1 1 1 1 1", MILD_OK, NULL},
    {"pose = 0 0.5", "pose = 2.1 0.5", MILD_ERROR_RANGE, "[joints] pose 2.1 neck -2 2"},
    {"pose = 0 0.5", "pose = -2.1 0.5", MILD_ERROR_RANGE, "[joints] pose -2.1 neck -2 2"},
    {"pose = 0 0.5", "pose = 2 0.5", MILD_OK, NULL},
    {"-0.2 0.4 -0.2", "-0.181 0.4 -0.2", MILD_OK, NULL}, /* 0.019 rad off level */
    {"-0.2 0.4 -0.2", "-0.179 0.4 -0.2", MILD_ERROR_FORMAT, "[foot.flat] [joints] pose"},
    {"pitch = 0.02", "pitch = 0.5", MILD_ERROR_RANGE, "robot.ini [foot.flat] sole.pitch"},
    /* shells */
    {"shells = chest belt bone", "shells = chest belts bone", MILD_ERROR_FORMAT,
     "walker.xml belts [robot] shells"},
    {"type='capsule' size='0.04 0.15' mass='2' ", "type='cylinder' size='0.04 0.15' mass='2' ",
     MILD_ERROR_FORMAT, "walker.xml bone [robot] shells"},
    {"<body name='thigh_l'", "<body", MILD_ERROR_FORMAT, "walker.xml bone"},
    /* what the step does not have */
    {"</worldbody>", "</worldbody><equality><joint joint1='hip_l' joint2='hip_r'/></equality>",
     MILD_ERROR_FORMAT, "walker.xml equality"},
    {"</worldbody>", "</worldbody><tendon><fixed><joint joint='hip_l' coef='1'/></fixed></tendon>",
     MILD_ERROR_FORMAT, "walker.xml tendons"},
    {"name='neck' axis='1 0 0'", "name='neck' type='slide' axis='1 0 0'", MILD_ERROR_FORMAT,
     "walker.xml neck"},
    {"name='neck'", "name='neck' frictionloss='0.1'", MILD_ERROR_FORMAT,
     "walker.xml neck frictionloss"},
    {"name='neck'", "name='neck' damping='0.1'", MILD_ERROR_FORMAT, "walker.xml neck damping"},
    {"name='neck'", "name='neck' stiffness='0.1'", MILD_ERROR_FORMAT, "walker.xml neck stiffness"},
    {"<light", "<body name='post'><geom size='0.1'/></body><light", MILD_OK, NULL},
    {"<motor joint='waist'/>", "", MILD_OK, NULL},
    {"<body name='toe_r' pos='0 0 -0.3'><geom type='sphere' size='0.03' mass='0.2'/></body>",
     "<body name='toe_r' pos='0 0 -0.3'/>", MILD_OK, NULL}, /* its parent has the mass */
    /* what MuJoCo does not read */
    {"model = walker.xml", "model = none.xml", MILD_ERROR_FORMAT, "none.xml"},
    {"</worldbody>", "", MILD_ERROR_FORMAT, "walker.xml"},
    {"axis='1 0 0'", "axis='0 0 0'", MILD_ERROR_FORMAT, "walker.xml neck"},
};

TEST(test_changes) {
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
        const Change *change = &changes[i];
        const int of_model = strstr(mjcf, change->from) != NULL;
        MildError error = {0};
        assert_true(of_model != (strstr(ini, change->from) != NULL));
        char *edited = kit_replaced(of_model ? mjcf : ini, change->from, change->to);
        Robot *made =
            kit_robot_of("walker.xml", of_model ? edited : mjcf, of_model ? ini : edited, &error);
        if (change->status == MILD_OK) {
            expect_good(made && !error.text[0], &error);
        } else {
            assert_null(made);
            assert_error(&error, change->status, change->names);
        }
        robot_destroy(made);
        free(edited);
    }
}

TEST_MAIN(setup, teardown)
