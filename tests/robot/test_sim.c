/* What a workspace reports of a step of SA01, against the engine's own functions on data of their
 * own: momentum, forces of rigid contact, steps on tilted planes; its limits and its clock. Its
 * feet and its steps without contact: test_walker.c. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "robot_kit.h"

#include <mujoco/mujoco.h>

#include "widest.h"

static const char *const feet[SA01_FEET] = {"leg_l6_link", "leg_r6_link"};
/* Middle of each sole's bounds in its foot's frame: 60 mm ahead, 5.5 mm outward, 55 mm below. */
static const double middle[SA01_FEET][3] = {{0.06, 0.0055, -0.055}, {0.06, -0.0055, -0.055}};

/* Anywhere, turned any way about z and up to `tilt` otherwise, bent within the joints' ranges. */
static RobotState draw_state(const Robot *of, uint32_t draw, double height, double tilt) {
    Random r = random_at(41, draw, 0);
    RobotState state = {.qpos = {random_uniform(&r, -1, 1), random_uniform(&r, -1, 1), height}};
    double angle[3] = {random_uniform(&r, -tilt, tilt), random_uniform(&r, -tilt, tilt),
                       random_uniform(&r, -3.1, 3.1)};
    mju_euler2Quat(state.qpos + 3, angle, "XYZ");
    for (int i = 0; i < robot_joints(of); i++) {
        double low = robot_joint_low(of)[i], high = robot_joint_high(of)[i];
        double q = robot_default_pose(of)[i] + random_uniform(&r, -0.15, 0.15);
        state.qpos[7 + i] = fmin(fmax(q, low + 0.01), high - 0.01);
    }
    for (int i = 0; i < 6 + robot_joints(of); i++) {
        state.qvel[i] = random_uniform(&r, -1, 1);
    }
    return state;
}

/* Data of their own at a pose of the sim's model. */
static mjData *engine_at(const mjModel *m, const double *qpos, const double *qvel) {
    mjData *d = mj_makeData(m);
    memcpy(d->qpos, qpos, sizeof(double) * SA01_NQ);
    memcpy(d->qvel, qvel, sizeof(double) * SA01_NV);
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d);
    return d;
}

static MildMap *waves(void) {
    MildMapDef def = mild_map_def_default();
    MildError error = {0};
    def.kind = MILD_MAP_WAVES;
    def.amplitude = 0.1;
    MildMap *map = mild_map_create(&def, &error);
    assert_non_null(map);
    return map;
}

/* Velocity of a point that moves with a body. */
static void point_velocity(const mjModel *m, const mjData *d, int body, const double point[3],
                           double linear[3], double angular[3]) {
    double jp[3 * SA01_NV], jr[3 * SA01_NV];
    mj_jac(m, d, jp, jr, point, body);
    mju_mulMatVec(linear, jp, d->qvel, 3, SA01_NV);
    mju_mulMatVec(angular, jr, d->qvel, 3, SA01_NV);
}

/* ---- steps ---- */

/* Near the ground, a little turned and bent, in motion. */
static RobotState random_state(uint32_t draw) {
    Random random = random_at(11, draw, 0);
    RobotState state = {.qpos = {0, 0, robot_stand_height(robot) - 0.005, 1}};
    for (int k = 3; k < 7; k++) {
        state.qpos[k] += random_uniform(&random, -0.1, 0.1);
    }
    mju_normalize4(state.qpos + 3);
    for (int i = 0; i < SA01_JOINTS; i++) {
        state.qpos[7 + i] = robot_default_pose(robot)[i] + random_uniform(&random, -0.1, 0.1);
    }
    for (int i = 0; i < SA01_NV; i++) {
        state.qvel[i] = random_uniform(&random, -0.5, 0.5);
    }
    return state;
}

/* Momentum, and angular momentum about the centre of mass, of these speeds at this pose. */
static void momentum(RobotSim *sim, const double *qpos, const double *qvel, double out[6],
                     double center[3]) {
    const mjModel *m = robot_sim_model(sim);
    mjData *d = engine_at(m, qpos, qvel);
    mj_subtreeVel(m, d);
    for (int k = 0; k < 3; k++) {
        out[k] = m->body_subtreemass[1] * d->subtree_linvel[3 + k];
        out[3 + k] = d->subtree_angmom[3 + k];
        center[k] = d->subtree_com[3 + k];
    }
    mj_deleteData(d);
}

/* wrench += a force and a torque at `point`, about `center`. */
static void add_wrench(double wrench[6], const double *force, const double *torque,
                       const double *point, const double *center) {
    double arm[3], moment[3];
    mju_sub3(arm, point, center);
    mju_cross(moment, arm, force);
    mju_addTo3(wrench, force);
    mju_addTo3(wrench + 3, torque);
    mju_addTo3(wrench + 3, moment);
}

/* Change of both momenta = dt (weight, push, feet), in contact and in the air. Exact at the pose of
 * the step's start and from rest: a step from there has no other terms. */
TEST(test_momentum) {
    RobotSim *sim = new_sim(0.0005);
    MildTerrain terrain = kit_terrain("foam60");
    MildGround *ground = kit_ground(robot);
    RobotVariation nominal = robot_variation_nominal();
    const double push[6] = {30, -20, 10, 4, -5, 6}, at_rest[SA01_NV] = {0};
    double largest[6] = {0};
    int loaded = 0;
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = random_state(draw);
        state.qpos[2] += draw % 2 ? 0.5 : 0.0;
        memset(state.qvel, 0, sizeof state.qvel);
        robot_sim_load(sim, &state, &nominal);
        mild_ground_reset(ground);
        double torque[SA01_JOINTS], before[6], after[6], center[3], wrench[6] = {0}, base[3];
        for (int i = 0; i < SA01_JOINTS; i++) {
            torque[i] = 3.0 - i;
        }
        memcpy(base, ((const mjData *)robot_sim_data(sim))->xipos + 3, sizeof base);
        momentum(sim, state.qpos, at_rest, before, center);
        add_wrench(wrench, push, push + 3, base, center);
        wrench[2] -= 9.81 * robot_total_mass(robot);
        double ankle[SA01_FEET][3];
        for (int f = 0; f < SA01_FEET; f++) {
            memcpy(ankle[f], robot_sim_foot(sim, f)->position, sizeof ankle[f]);
        }
        assert_int_equal(robot_sim_step(sim, torque, push, &terrain, ground), 0);
        for (int f = 0; f < SA01_FEET; f++) {
            const RobotFoot *foot = robot_sim_foot(sim, f);
            loaded += foot->force[2] > 1;
            add_wrench(wrench, foot->force, foot->torque, ankle[f], center);
        }
        momentum(sim, state.qpos, robot_sim_qvel(sim), after, center);
        for (int k = 0; k < 6; k++) {
            double change = after[k] - before[k];
            largest[k] = fmax(largest[k], fabs(change));
            expect_entry("momentum", k, change, robot_sim_dt(sim) * wrench[k], 1e-12);
        }
    }
    for (int k = 0; k < 6; k++) {
        assert_true(largest[k] > 0.01);
    }
    assert_true(loaded >= 10);
    free(ground);
    robot_sim_destroy(sim);
}

/* A step moves the ground's memory on, once, with its own input and result: so a second foot fall
 * finds the imprint of the first. */
TEST(test_step_moves_the_ground) {
    RobotSim *sim = new_sim(0.0025);
    RobotVariation nominal = robot_variation_nominal();
    MildTerrain terrain = kit_terrain("sand_loose");
    MildGround *ground = kit_ground(robot), *other = kit_ground(robot), *virgin = kit_ground(robot);
    size_t bytes = mild_ground_size(ground);
    RobotState state = draw_state(robot, 2, 1, 0.05);
    double torque[SA01_JOINTS] = {0};
    robot_sim_load(sim, &state, &nominal);
    state.qpos[2] -= robot_sim_sole_clearance(sim, &terrain) + 0.005;
    memset(state.qvel, 0, sizeof state.qvel);
    state.qvel[2] = -0.3;
    robot_sim_load(sim, &state, &nominal);
    for (int i = 0; i < 10; i++) {
        memcpy(other, ground, bytes);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        mild_ground_advance(other, &terrain, robot_sim_contact_input(sim), robot_sim_scratch(sim),
                            robot_sim_contact(sim));
        assert_memory_equal(other, ground, bytes);
        assert_memory_not_equal(virgin, ground, bytes);
    }
    assert_true(robot_sim_contact(sim)->foot[0].force[2] > 1 ||
                robot_sim_contact(sim)->foot[1].force[2] > 1);
    free(ground);
    free(other);
    free(virgin);
    robot_sim_destroy(sim);
}

/* Speeds up to 1000 are numbers; beyond, and under bad torques, they went bad. */
TEST(test_bad_numbers) {
    static const struct {
        double speed, torque;
        int bad;
    } cases[] = {{999, 0, 0}, {-999, 0, 0}, {1001, 0, 1}, {-1001, 0, 1},
                 {0, NAN, 1}, {0, 1e9, 1},  {0, 0, 0}};
    RobotSim *sim = new_sim(0.001);
    RobotVariation nominal = robot_variation_nominal();
    MildTerrain terrain = kit_terrain("sand_loose");
    MildGround *ground = kit_ground(robot);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        RobotState state = draw_state(robot, 3, 50, 0);
        double torque[SA01_JOINTS] = {0};
        memset(state.qvel, 0, sizeof state.qvel);
        state.qvel[1] = cases[i].speed;
        torque[3] = cases[i].torque;
        robot_sim_load(sim, &state, &nominal);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), cases[i].bad);
    }
    free(ground);
    robot_sim_destroy(sim);
}

/* Loaded and stored is the same; a load leaves nothing of the last step. */
TEST(test_load_and_store) {
    RobotSim *sim = new_sim(0.001);
    RobotVariation nominal = robot_variation_nominal();
    MildTerrain terrain = kit_terrain("sand_loose");
    MildGround *ground = kit_ground(robot);
    RobotState state = draw_state(robot, 2, 1, 0.1), back;
    double torque[SA01_JOINTS] = {0};
    robot_sim_load(sim, &state, &nominal);
    state.qpos[2] -= robot_sim_sole_clearance(sim, &terrain) + 0.01; /* a foot 10 mm deep */
    state.qvel[2] = -0.5;
    for (int i = 0; i < SA01_NV; i++) {
        state.qacc[i] = 0.5 * i;
    }
    robot_sim_load(sim, &state, &nominal);
    robot_sim_store(sim, &back);
    assert_memory_equal(&state, &back, sizeof state);
    assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
    assert_true(robot_sim_foot(sim, 0)->force[2] > 1 || robot_sim_foot(sim, 1)->force[2] > 1);
    robot_sim_load(sim, &state, &nominal);
    const MildContactResult none = {0};
    assert_memory_equal(robot_sim_contact(sim), &none, sizeof none);
    for (int f = 0; f < SA01_FEET; f++) {
        for (int k = 0; k < 3; k++) {
            expect_entry("force", k, robot_sim_foot(sim, f)->force[k], 0, 0);
        }
        assert_int_equal(robot_sim_foot(sim, f)->result.contacts, 0);
    }
    assert_true(((const mjData *)robot_sim_data(sim))->time == 0);
    free(ground);
    robot_sim_destroy(sim);
}

/* A new workspace stands in the default pose. */
TEST(test_new_workspace) {
    RobotSim *sim = new_sim(0.002);
    assert_true(robot_sim_dt(sim) == 0.002);
    const double *q = robot_sim_qpos(sim);
    const double base[7] = {0, 0, robot_stand_height(robot), 1, 0, 0, 0};
    assert_memory_equal(q, base, sizeof base);
    assert_memory_equal(q + 7, robot_default_pose(robot), sizeof(double) * SA01_JOINTS);
    expect_entry("sole", 0, robot_sim_foot(sim, 0)->sole_height, 0, 1e-9);
    for (int i = 0; i < SA01_NV; i++) {
        assert_true(robot_sim_qvel(sim)[i] == 0);
    }
    const MildContactInput *input = robot_sim_contact_input(sim);
    assert_int_equal(input->feet, SA01_FEET);
    assert_true(input->dt == 0.002);
    robot_sim_set_solver(sim, MILD_SOLVER_GAUSS_SEIDEL, 1e-3, 77);
    assert_true(input->solver == MILD_SOLVER_GAUSS_SEIDEL && input->tolerance == 1e-3);
    assert_int_equal(input->max_iterations, 77);
    robot_sim_destroy(sim);
}

TEST(test_time_steps) {
    const double good[] = {0.0001, 0.01}, bad[] = {0.000099, 0.0101, 0, -0.001, NAN};
    for (int i = 0; i < 2; i++) {
        robot_sim_destroy(new_sim(good[i]));
    }
    for (int i = 0; i < 5; i++) {
        MildError error = {0};
        assert_null(robot_sim_create(robot, bad[i], &error));
        assert_error(&error, MILD_ERROR_RANGE, "0.0001 0.01");
    }
    robot_sim_destroy(NULL);
}

/* Every part takes some time, steps are counted, NULL stops it. */
TEST(test_phases) {
    RobotVariation variation = robot_variation_nominal();
    MildTerrain terrain = kit_terrain("sand_loose");
    MildGround *ground = kit_ground(robot);
    for (int rigid = 0; rigid < 2; rigid++) {
        RobotSim *sim = new_sim(0.001);
        RobotPhases phases = {0};
        double torque[SA01_JOINTS] = {0};
        RobotState state = draw_state(robot, 2, 0.8, 0.1);
        variation.rigid = rigid;
        robot_sim_load(sim, &state, &variation);
        robot_sim_time_phases(sim, &phases);
        for (int i = 0; i < 20; i++) {
            RobotPhases before = phases;
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
            assert_true(phases.smooth > before.smooth && phases.finish > before.finish);
            assert_true(phases.ground > before.ground && phases.map >= before.map);
        }
        assert_int_equal(phases.steps, 20);
        assert_true(rigid ? phases.map == 0 : phases.map > 0);
        assert_true(phases.smooth + phases.map + phases.ground + phases.finish < 10);
        RobotPhases last = phases;
        robot_sim_time_phases(sim, NULL);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        assert_memory_equal(&phases, &last, sizeof last);
        robot_sim_destroy(sim);
    }
    free(ground);
}

/* ---- rigid contact ---- */

typedef struct {
    int contacts;
    double depth_max, depth_sum, load, pressure[3], force[3], torque[3];
} Sum;

/* The contact's plane is the ground's under the corner's centre. */
static void expect_normal(const mjModel *m, const mjContact *contact, const MildTerrain *terrain) {
    const double *normal = contact->frame;
    double reach = 0.5 * contact->dist + m->geom_size[3 * contact->geom[1]], slope[2];
    mild_terrain_slope_at(terrain, contact->pos[0] + reach * normal[0],
                          contact->pos[1] + reach * normal[1], slope);
    expect_entry("slope along x", 0, -normal[0] / normal[2], slope[0], 1e-9);
    expect_entry("slope along y", 1, -normal[1] / normal[2], slope[1], 1e-9);
}

/* Contact by contact from the engine's data: a contact's force is on its second geom; ours acts on
 * the foot. The model's pairs name the floor first. */
static void add_up(const mjModel *m, const mjData *d, const MildTerrain *terrain,
                   double ankle[SA01_FEET][3], Sum sum[SA01_FEET]) {
    int floor = mj_name2id(m, mjOBJ_GEOM, "floor");
    for (int c = 0; c < d->ncon; c++) {
        const mjContact *contact = d->contact + c;
        double local[6], force[3], arm[3], moment[3];
        mj_contactForce(m, d, c, local);
        if (local[0] <= 0) {
            continue;
        }
        mju_mulMatTVec3(force, contact->frame, local);
        assert_int_equal(contact->geom[0], floor);
        expect_normal(m, contact, terrain);
        int body = m->geom_bodyid[contact->geom[1]];
        int f = body == mj_name2id(m, mjOBJ_BODY, feet[1]);
        mju_sub3(arm, contact->pos, ankle[f]);
        mju_cross(moment, arm, force);
        double normal = contact->frame[2] * local[0];
        for (int k = 0; k < 3; k++) {
            sum[f].force[k] += force[k];
            sum[f].torque[k] += moment[k];
            sum[f].pressure[k] += normal * contact->pos[k];
        }
        sum[f].load += normal;
        sum[f].contacts++;
        sum[f].depth_sum -= contact->dist;
        sum[f].depth_max = fmax(sum[f].depth_max, -contact->dist);
    }
}

/* On the sole plane under the ankle the moment about the zero-moment point has no level part; about
 * the axis it is along the force. */
static void check_zmp(const MildFootResult *r, const double rotation[9], const double center[3]) {
    double square = mju_dot3(r->force, r->force), moment[3], rest[3], along[3];
    double down[3];
    mju_mulMatVec3(down, rotation, center);
    const double point[3] = {r->zmp_sole[0], r->zmp_sole[1], down[2]};
    mju_cross(moment, point, r->force);
    expect_entry("level moment", 0, r->torque[0] - moment[0], 0, 1e-9 * (1 + fabs(r->torque[0])));
    expect_entry("level moment", 1, r->torque[1] - moment[1], 0, 1e-9 * (1 + fabs(r->torque[1])));
    expect_entry("axis across the force", 0, mju_dot3(r->zmp_axis, r->force), 0, 1e-9);
    mju_cross(moment, r->zmp_axis, r->force);
    mju_sub3(rest, r->torque, moment);
    mju_scl3(along, r->force, mju_dot3(r->force, r->torque) / square);
    for (int k = 0; k < 3; k++) {
        expect_entry("moment along the force", k, rest[k], along[k], 1e-8);
    }
}

static void check_rigid(const RobotSim *sim, const Sum *sum, int f, const double rotation[9]) {
    const MildFootResult *r = &robot_sim_contact(sim)->foot[f];
    const RobotFoot *foot = robot_sim_foot(sim, f);
    assert_int_equal(r->contacts, sum->contacts);
    for (int k = 0; k < 3; k++) {
        expect_entry("force", k, r->force[k], sum->force[k], 1e-9);
        expect_entry("torque", k, r->torque[k], sum->torque[k], 1e-9);
        expect_entry("force of the foot", k, foot->force[k], r->force[k], 0);
        expect_entry("torque of the foot", k, foot->torque[k], r->torque[k], 0);
    }
    assert_memory_equal(&foot->result, r, sizeof *r);
    expect_entry("greatest depth", f, r->depth_max, sum->depth_max, 1e-12);
    if (sum->contacts == 0) {
        expect_entry("mean depth", f, r->depth_mean, 0, 0);
        return;
    }
    expect_entry("mean depth", f, r->depth_mean, sum->depth_sum / sum->contacts, 1e-12);
    for (int k = 0; k < 3; k++) {
        expect_entry("centre of pressure", k, r->pressure_center[k], sum->pressure[k] / sum->load,
                     1e-12);
    }
    check_zmp(r, rotation, middle[f]);
}

/* A step with the joints held stiff; the engine's data keep the contacts of the step's forces until
 * the next. Counts the loaded feet; returns how many of them stand on some corners only. */
static int check_rigid_step(RobotSim *sim, const MildTerrain *terrain, int loaded[SA01_FEET]) {
    const mjModel *m = robot_sim_model(sim);
    const mjData *d = robot_sim_data(sim);
    int partly = 0;
    double torque[SA01_JOINTS], ankle[SA01_FEET][3], rotation[SA01_FEET][9];
    const double *q = robot_sim_qpos(sim) + 7, *qd = robot_sim_qvel(sim) + 6;
    for (int j = 0; j < SA01_JOINTS; j++) {
        torque[j] = 100 * (robot_default_pose(robot)[j] - q[j]) - 3 * qd[j];
    }
    double twist[SA01_FEET][6];
    mjData *start = engine_at(m, robot_sim_qpos(sim), robot_sim_qvel(sim));
    for (int f = 0; f < SA01_FEET; f++) {
        memcpy(ankle[f], robot_sim_foot(sim, f)->position, sizeof ankle[f]);
        memcpy(rotation[f], robot_sim_foot(sim, f)->rotation, sizeof rotation[f]);
    }
    assert_int_equal(robot_sim_step(sim, torque, NULL, terrain, NULL), 0);
    Sum sum[SA01_FEET] = {{0}};
    add_up(m, d, terrain, ankle, sum);
    memcpy(start->qvel, robot_sim_qvel(sim), sizeof(double) * SA01_NV);
    for (int f = 0; f < SA01_FEET; f++) {
        check_rigid(sim, &sum[f], f, rotation[f]);
        point_velocity(m, start, mj_name2id(m, mjOBJ_BODY, feet[f]), ankle[f], twist[f],
                       twist[f] + 3);
        for (int k = 0; k < 6; k++) {
            expect_entry("twist at the end", k, robot_sim_contact(sim)->velocity[6 * f + k],
                         twist[f][k], 1e-9);
        }
        loaded[f] += sum[f].contacts > 0;
        partly += sum[f].contacts > 0 && sum[f].contacts < 4;
    }
    mj_deleteData(start);
    assert_true(robot_sim_contact(sim)->converged);
    assert_int_equal(robot_sim_contact(sim)->iterations, d->solver_niter[0]);
    return partly;
}

/* Standing shakily on slopes, contacts coming and going. */
TEST(test_rigid_contact) {
    RobotSim *sim = new_sim(0.0025);
    RobotVariation rigid = robot_variation_nominal();
    rigid.rigid = 1;
    MildMap *map = waves();
    MildTerrain level = kit_terrain("grass"), wavy = level;
    level.height = -0.1;
    wavy.map = map;
    int loaded[SA01_FEET] = {0}, partly = 0;
    for (uint32_t draw = 0; draw < 12; draw++) {
        const MildTerrain *terrain = draw % 2 ? &level : &wavy;
        RobotState state = draw_state(robot, draw, 1, 0.1);
        robot_sim_load(sim, &state, &rigid);
        state.qpos[2] -= robot_sim_sole_clearance(sim, terrain) + 0.003;
        robot_sim_load(sim, &state, &rigid);
        for (int i = 0; i < 25; i++) {
            partly += check_rigid_step(sim, terrain, loaded);
        }
    }
    assert_true(loaded[0] > 50 && loaded[1] > 50 && partly > 50);
    mild_map_destroy(map);
    robot_sim_destroy(sim);
}

/* A plane of these rises per metre, whose heights a float holds exactly. */
static MildMap *plane_map(double along_x, double along_y) {
    enum { EDGE = 9 };
    double heights[EDGE * EDGE];
    for (int r = 0; r < EDGE; r++) {
        for (int c = 0; c < EDGE; c++) {
            heights[EDGE * r + c] = along_x * (c - EDGE / 2) + along_y * (EDGE / 2 - r);
        }
    }
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_IMAGE;
    def.amplitude = def.cell = 1;
    def.heights = heights;
    def.height_columns = def.height_rows = EDGE;
    MildMap *map = mild_map_create(&def, NULL);
    assert_non_null(map);
    return map;
}

/* A slope is the engine's own floor, tilted, also where it is so steep that the engine takes other
 * tangents: robots dropped onto the plane, limp. */
TEST(test_any_plane_is_the_engine) {
    static const double planes[][2] = {{0, 0.25}, {0.25, -0.5}, {0, 0.75}, {-0.25, -1}, {0, 1.5}};
    int contacts = 0;
    for (uint32_t draw = 0; draw < 10; draw++) {
        const double *rise = planes[draw % 5];
        double length = sqrt(1 + rise[0] * rise[0] + rise[1] * rise[1]);
        const double normal[3] = {-rise[0] / length, -rise[1] / length, 1 / length};
        MildMap *map = plane_map(rise[0], rise[1]);
        MildTerrain terrain = kit_terrain("sand_loose");
        terrain.map = map;
        RobotSim *sim = new_sim(0.001);
        mjModel *m = robot_sim_model(sim);
        mjData *engine = mj_makeData(m);
        RobotState state = random_state(draw);
        RobotVariation rigid = robot_variation_nominal();
        int floor = mj_name2id(m, mjOBJ_GEOM, "floor");
        rigid.rigid = 1;
        rigid.rigid_friction = 0.6;
        mju_quatZ2Vec(m->geom_quat + 4 * floor, normal);
        m->geom_sameframe[floor] = mjSAMEFRAME_NONE;
        robot_sim_load(sim, &state, &rigid);
        state.qpos[2] -= robot_sim_sole_clearance(sim, &terrain) - 0.001;
        robot_sim_load(sim, &state, &rigid);
        memcpy(engine->qpos, state.qpos, sizeof state.qpos);
        memcpy(engine->qvel, state.qvel, sizeof state.qvel);
        for (int i = 0; i < 150; i++) {
            double torque[SA01_JOINTS] = {0};
            mj_step(m, engine);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, NULL), 0);
            contacts += robot_sim_contact(sim)->foot[0].contacts;
            contacts += robot_sim_contact(sim)->foot[1].contacts;
        }
        for (int i = 0; i < SA01_NQ; i++) {
            expect_entry("position", i, robot_sim_qpos(sim)[i], engine->qpos[i], 1e-9);
        }
        mj_deleteData(engine);
        robot_sim_destroy(sim);
        mild_map_destroy(map);
    }
    assert_true(contacts > 1000);
}

/* ---- four feet ---- */

/* Least of both mirrored pairs: feet, then knees, left less right along the base's left; 0 when the
 * base points straight up. */
TEST(test_distances) {
    MildError error = {0};
    Robot *widest = widest_open(&error);
    expect_good(widest != NULL, &error);
    RobotSim *sim = robot_sim_create(widest, 0.001, &error);
    assert_non_null(sim);
    RobotVariation nominal = robot_variation_nominal();
    const mjData *d = robot_sim_data(sim);
    const mjModel *m = robot_sim_model(sim);
    int which[2] = {0};
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = draw_state(widest, draw, 3, 1);
        robot_sim_load(sim, &state, &nominal);
        const double x[3] = {1, 0, 0}, z[3] = {0, 0, 1};
        double ahead[3], left[3], feet[2], knees[2];
        mju_rotVecQuat(ahead, x, state.qpos + 3);
        ahead[2] = 0;
        mju_normalize3(ahead);
        mju_cross(left, z, ahead);
        for (int pair = 0; pair < 2; pair++) {
            double between[3];
            char name[2][8];
            mju_sub3(between, robot_sim_foot(sim, 2 * pair)->sole_center,
                     robot_sim_foot(sim, 2 * pair + 1)->sole_center);
            feet[pair] = mju_dot3(between, left);
            for (int side = 0; side < 2; side++) {
                snprintf(name[side], sizeof name[side], "b%d5", 2 * pair + side);
            }
            mju_sub3(between, d->xpos + 3 * mj_name2id(m, mjOBJ_BODY, name[0]),
                     d->xpos + 3 * mj_name2id(m, mjOBJ_BODY, name[1]));
            knees[pair] = mju_dot3(between, left);
        }
        which[feet[0] < feet[1]]++;
        assert_true(fabs(robot_sim_foot_distance(sim) - fmin(feet[0], feet[1])) < 1e-12);
        assert_true(fabs(robot_sim_knee_distance(sim) - fmin(knees[0], knees[1])) < 1e-12);
    }
    assert_true(which[0] > 2 && which[1] > 2);
    RobotState up = draw_state(widest, 0, 3, 1);
    const double nose_up[4] = {sqrt(0.5), 0, -sqrt(0.5), 0};
    memcpy(up.qpos + 3, nose_up, sizeof nose_up);
    robot_sim_load(sim, &up, &nominal);
    assert_true(robot_sim_knee_distance(sim) == 0 && robot_sim_foot_distance(sim) == 0);
    robot_sim_destroy(sim);
    assert_int_equal(widest_close(widest), 0);
}

TEST_MAIN(setup, teardown)
