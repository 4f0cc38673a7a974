/* Shells that stand on rigid ground, by MuJoCo: against mj_step with the geoms of the robot's file
 * on a plane, against statics, mirrored, and the energy of falls. That in the air they change no
 * bit of a step is in test_shells.c, the batch engine's step is held to this one in
 * engine/test_floor.c. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "all_robots.h"

static const double gravity = 9.81;

static RobotVariation rigid_variation(void) {
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = 1;
    variation.rigid_friction = 0.8;
    return variation;
}

static RobotSim *open_sim(Robot *robot, double dt) {
    robot_set_shells(robot, 1);
    RobotSim *sim = robot_sim_create(robot, dt, NULL);
    assert_non_null(sim);
    return sim;
}

/* ---- MuJoCo's own model ---- */

static void add_pair(mjSpec *spec, const char *geom) {
    static const double friction[5] = {0.8, 0.8, 0.005, 0.0001, 0.0001};
    mjsPair *pair = mjs_addPair(spec, NULL);
    mjs_setString(pair->geomname1, "plane");
    mjs_setString(pair->geomname2, geom);
    pair->condim = 3;
    memcpy(pair->friction, friction, sizeof friction);
}

/* The robot's file with a plane that its shells touch, as the geoms that they are, and the spheres
 * of its feet. */
static mjModel *own_model(const Robot *robot) {
    char text[256] = "";
    mjSpec *spec = mj_parseXML(robot->path, NULL, text, sizeof text);
    if (!spec) {
        fail_msg("%s", text);
    }
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_GEOM); e; e = mjs_nextElement(spec, e)) {
        mjs_asGeom(e)->contype = mjs_asGeom(e)->conaffinity = 0;
    }
    mjsGeom *plane = mjs_addGeom(mjs_findBody(spec, "world"), NULL);
    mjs_setName(plane->element, "plane");
    plane->type = mjGEOM_PLANE;
    plane->size[2] = 1;
    plane->contype = plane->conaffinity = 0;
    for (int s = 0; s < robot->def.shells; s++) {
        add_pair(spec, robot->def.shell[s]);
    }
    for (int f = 0; f < robot->def.feet; f++) {
        const RobotFootDef *foot = &robot->def.foot[f];
        for (int c = 0; c < foot->corner_count; c++) {
            char name[32];
            snprintf(name, sizeof name, "sphere_%d_%d", f, c);
            mjsGeom *sphere = mjs_addGeom(mjs_findBody(spec, foot->body), NULL);
            mjs_setName(sphere->element, name);
            sphere->type = mjGEOM_SPHERE;
            sphere->size[0] = foot->corner_radius;
            sphere->mass = 0;
            sphere->contype = sphere->conaffinity = 0;
            memcpy(sphere->pos, foot->corners + 3 * c, sizeof sphere->pos);
            add_pair(spec, name);
        }
    }
    mjModel *model = mj_compile(spec, NULL);
    assert_non_null(model);
    mj_deleteSpec(spec);
    return model;
}

/* Both from one state; `drive` gives the torques of either. */
typedef struct {
    mjModel *model;
    mjData *data;
    RobotSim *sim;
    MildTerrain terrain;
} Both;

static Both open_both(Robot *robot, const RobotState *state, double dt) {
    Both both = {.model = own_model(robot), .sim = open_sim(robot, dt)};
    const RobotVariation rigid = rigid_variation();
    both.terrain = kit_terrain("rubber");
    both.model->opt.timestep = dt;
    both.data = mj_makeData(both.model);
    assert_int_equal(both.model->nq, robot->nq);
    robot_engine_qpos(robot, state->qpos, both.data->qpos);
    robot_engine_rates(robot, state->qvel, both.data->qvel);
    robot_sim_load(both.sim, state, &rigid);
    return both;
}

static void close_both(Both *both) {
    robot_sim_destroy(both->sim);
    mj_deleteData(both->data);
    mj_deleteModel(both->model);
}

/* Torques that hold a pose, from qpos and qvel in the robot's order. */
static void hold(const Robot *robot, const double *pose, double share, const double *qpos,
                 const double *qvel, double *torque) {
    for (int j = 0; j < robot->def.joints; j++) {
        const double error = pose[j] - qpos[7 + j] - 0.03 * qvel[6 + j];
        torque[j] = share * robot->effort[j] * error;
        torque[j] = fmax(fmin(torque[j], robot->effort[j]), -robot->effort[j]);
    }
}

static void step_both(Both *both, const double *pose, double share) {
    const Robot *robot = both->sim->robot;
    double torque[ROBOT_JOINTS_MAX], qpos[ROBOT_NQ_MAX], qvel[ROBOT_NV_MAX];
    hold(robot, pose, share, robot_sim_qpos(both->sim), robot_sim_qvel(both->sim), torque);
    assert_int_equal(robot_sim_step(both->sim, torque, NULL, &both->terrain, NULL), 0);
    for (int j = 0; j < robot->def.joints; j++) {
        qpos[7 + j] = both->data->qpos[robot->dof[j] + 1];
        qvel[6 + j] = both->data->qvel[robot->dof[j]];
    }
    hold(robot, pose, share, qpos, qvel, torque);
    for (int j = 0; j < robot->def.joints; j++) {
        both->data->qfrc_applied[robot->dof[j]] = torque[j];
    }
    mj_step(both->model, both->data);
}

static double apart(const Both *both) {
    double most = 0;
    for (int i = 0; i < both->model->nq; i++) {
        most = fmax(most, fabs(both->data->qpos[i] - both->sim->data->qpos[i]));
    }
    return most;
}

/* SA01's shells are boxes, of which MuJoCo takes the corners as well: the same falls. */
TEST(boxes_are_those_of_mj_step) {
    double worst = 0;
    int loaded = 0;
    for (uint32_t draw = 0; draw < 12; draw++) {
        Random random = random_at(9, draw, 0);
        RobotState state = {.qpos = {0, 0, 0.9, 1, 0.2 * (draw % 3) - 0.2, 0.15 * (draw % 4), 0}};
        mju_normalize4(state.qpos + 3);
        for (int j = 0; j < robots[0]->def.joints; j++) {
            state.qpos[7 + j] = robots[0]->def.pose[j] + random_uniform(&random, -0.2, 0.2);
        }
        state.qvel[0] = random_uniform(&random, -1, 1);
        Both both = open_both(robots[0], &state, 0.001);
        for (int s = 0; s < 700; s++) {
            step_both(&both, robots[0]->def.pose, 0);
            loaded += robot_sim_shell_load(both.sim) > 0;
        }
        worst = fmax(worst, apart(&both));
        close_both(&both);
    }
    print_message("falls against mj_step with boxes: %d steps with shells down, worst %.1e\n",
                  loaded, worst);
    assert_true(loaded > 1000 && worst < 1e-6);
}

/* ---- at rest ---- */

/* [N] Vertical force of mj_step's plane on the geoms of feet or shells. */
static double own_load(const Both *both, int shells) {
    double sum = 0;
    for (int c = 0; c < both->data->ncon; c++) {
        const mjContact *contact = both->data->contact + c;
        const char *name = mj_id2name(both->model, mjOBJ_GEOM, contact->geom[1]);
        double force[6];
        mj_contactForce(both->model, both->data, c, force);
        for (int k = 0; k < 3 && (strncmp(name, "sphere_", 7) != 0) == shells; k++) {
            sum += force[k] * contact->frame[3 * k + 2];
        }
    }
    return sum;
}

/* Legs folded. */
static void fold(const Robot *robot, double *pose) {
    for (int j = 0; j < robot->def.joints; j++) {
        pose[j] = robot->def.pose[j] + 0.6 * robot->def.swing[j];
        pose[j] = fmax(fmin(pose[j], robot->high[j] - 0.05), robot->low[j] + 0.05);
    }
}

typedef struct {
    double height, shells, feet; /* [m], [-] of the weight: mean over the last second */
    double own_height, own_shells, own_feet;
} Rest;

/* After four seconds. */
static Rest rest_of(Both *both, const double *pose) {
    enum { STEPS = 1600, LAST = 400 };
    const Robot *robot = both->sim->robot;
    const double weight = gravity * robot->total_mass;
    Rest rest = {0};
    for (int s = 0; s < STEPS; s++) {
        step_both(both, pose, 2);
        if (s < STEPS - LAST) {
            continue;
        }
        rest.height += robot_sim_qpos(both->sim)[2] / LAST;
        rest.own_height += both->data->qpos[2] / LAST;
        rest.shells += robot_sim_shell_load(both->sim) / weight / LAST;
        rest.own_shells += own_load(both, 1) / weight / LAST;
        rest.own_feet += own_load(both, 0) / weight / LAST;
        for (int f = 0; f < robot->def.feet; f++) {
            rest.feet += robot_sim_foot(both->sim, f)->force[2] / weight / LAST;
        }
    }
    return rest;
}

static void check_rest(const char *name, const Rest *rest) {
    print_message("%s: base at %.5f m, of mj_step %.5f m; shells carry %.4f of the weight and "
                  "%.4f, feet %.4f and %.4f\n",
                  name, rest->height, rest->own_height, rest->shells, rest->own_shells, rest->feet,
                  rest->own_feet);
    assert_true(fabs(rest->height - rest->own_height) < 1e-3);
    assert_true(fabs(rest->shells - rest->own_shells) < 0.005);
    assert_true(fabs(rest->feet - rest->own_feet) < 0.005);
    assert_true(fabs(rest->shells + rest->feet - 1) < 1e-3);
}

/* On its back and on either side a robot comes to rest where MuJoCo's own geoms do, and shells and
 * feet carry its weight. */
TEST(lying_robots_are_those_of_mj_step) {
    static const double half = 0.7071067811865476;
    const double turns[3][4] = {{0, 1, 0, 0}, {half, half, 0, 0}, {half, -half, 0, 0}};
    for (int n = 0; n < 3 * ROBOTS; n++) {
        Robot *robot = robots[n / 3];
        RobotState state = {.qpos = {0, 0, 0.6}};
        double pose[ROBOT_JOINTS_MAX];
        fold(robot, pose);
        memcpy(state.qpos + 3, turns[n % 3], sizeof turns[0]);
        memcpy(state.qpos + 7, pose, sizeof pose);
        Both both = open_both(robot, &state, 0.0025);
        const Rest rest = rest_of(&both, pose);
        check_rest(names[n / 3], &rest);
        assert_true(rest.shells > 0.5);
        close_both(&both);
    }
}

/* SA01 on its knees, thighs leaning back, its base in the air: the shins' lower edges and the toes
 * share the weight by the law of the lever. */
TEST(kneeling_follows_the_lever) {
    Robot *robot = robots[0];
    RobotState state = {.qpos = {0, 0, 0.55, 1}};
    double pose[ROBOT_JOINTS_MAX] = {0};
    for (int leg = 0; leg < 2; leg++) {
        pose[6 * leg + 2] = -0.3;
        pose[6 * leg + 3] = 2.1;
        pose[6 * leg + 4] = 0.45;
    }
    memcpy(state.qpos + 7, pose, sizeof pose);
    Both both = open_both(robot, &state, 0.0025);
    const Rest rest = rest_of(&both, pose);
    check_rest("kneeling", &rest);
    double shins = 0, toes = 0;
    for (int c = 0; c < both.data->ncon; c++) {
        const mjContact *contact = both.data->contact + c;
        const char *name = mj_id2name(both.model, mjOBJ_GEOM, contact->geom[1]);
        *(strncmp(name, "sphere_", 7) ? &shins : &toes) = contact->pos[0];
        assert_true(strcmp(name, "base_link_box") != 0);
    }
    const double middle = robot_sim_mass_center(both.sim)[0];
    const double share = (middle - toes) / (shins - toes);
    print_message("shins at %.3f m, toes at %.3f m, centre of mass at %.3f m: %.4f of the weight\n",
                  shins, toes, middle, share);
    assert_true(share > 0.2 && share < 0.95 && fabs(rest.shells - share) < 0.005);
    assert_true(robot_sim_base_clearance(both.sim, &both.terrain) > 0.2);
    close_both(&both);
}

/* ---- mirror images ---- */

static void mirror(const Robot *robot, const RobotState *from, RobotState *to) {
    static const double pose[7] = {1, -1, 1, 1, -1, 1, -1}, rate[6] = {1, -1, 1, -1, 1, -1};
    for (int i = 0; i < 7; i++) {
        to->qpos[i] = pose[i] * from->qpos[i];
    }
    for (int i = 0; i < 6; i++) {
        to->qvel[i] = rate[i] * from->qvel[i];
    }
    for (int j = 0; j < robot->def.joints; j++) {
        const double sign = robot->def.mirror_sign[j];
        to->qpos[7 + j] = sign * from->qpos[7 + robot->mirror_joint[j]];
        to->qvel[6 + j] = sign * from->qvel[6 + robot->mirror_joint[j]];
    }
}

/* Gives every body the mass of its other side, which the makers' files have nearly. */
static void mirror_masses(const Robot *robot) {
    mjModel *m = robot->model;
    mjData *data = mj_makeData(m);
    m->body_ipos[3 * robot->base_body + 1] = 0;
    mju_zero4(m->body_iquat + 4 * robot->base_body);
    m->body_iquat[4 * robot->base_body] = 1;
    for (int j = 0; j < robot->def.joints; j++) {
        const int from = m->dof_bodyid[robot->dof[j]];
        const int to = m->dof_bodyid[robot->dof[robot->mirror_joint[j]]];
        const double *place = m->body_ipos + 3 * from, *turn = m->body_iquat + 4 * from;
        const double sides[3] = {1, -1, 1}, turns[4] = {1, -1, 1, -1};
        m->body_mass[to] = m->body_mass[from];
        mju_copy3(m->body_inertia + 3 * to, m->body_inertia + 3 * from);
        for (int k = 0; k < 3; k++) {
            m->body_ipos[3 * to + k] = sides[k] * place[k];
        }
        for (int k = 0; k < 4; k++) {
            m->body_iquat[4 * to + k] = turns[k] * turn[k];
        }
        if (to == from) { /* a joint of the trunk */
            m->body_ipos[3 * to + 1] = 0;
            mju_zero4(m->body_iquat + 4 * to);
            m->body_iquat[4 * to] = 1;
        }
    }
    mj_setConst(m, data);
    mj_deleteData(data);
}

/* A fall and its mirror image, and the load of the shells in both. */
TEST(falls_are_mirrored) {
    const RobotVariation rigid = rigid_variation();
    const MildTerrain terrain = kit_terrain("rubber");
    const double zero[ROBOT_JOINTS_MAX] = {0};
    for (int r = 0; r < ROBOTS; r++) {
        RobotState state = {.qpos = {0, 0, 0.5, 0.9, 0.35, 0.2, 0.1}, .qvel = {0.5, 0.3, 0, 1}};
        RobotState image = {0}, ends[2];
        double load[2] = {0}, most = 0;
        mirror_masses(robots[r]);
        mju_normalize4(state.qpos + 3);
        fold(robots[r], state.qpos + 7);
        state.qpos[7] += 0.1;
        mirror(robots[r], &state, &image);
        for (int n = 0; n < 2; n++) {
            RobotSim *sim = open_sim(robots[r], 0.0025);
            robot_sim_load(sim, n ? &image : &state, &rigid);
            for (int s = 0; s < 200; s++) {
                assert_int_equal(robot_sim_step(sim, zero, NULL, &terrain, NULL), 0);
                load[n] += robot_sim_shell_load(sim) / 200;
            }
            robot_sim_store(sim, &ends[n]);
            robot_sim_destroy(sim);
        }
        mirror(robots[r], &ends[1], &image);
        for (int i = 0; i < robots[r]->nq; i++) {
            most = fmax(most, fabs(image.qpos[i] - ends[0].qpos[i]));
        }
        print_message("%s: shells carry %.1f and %.1f N on average; poses differ by %.1e\n",
                      names[r], load[0], load[1], most);
        assert_true(load[0] > 10 && fabs(load[0] / load[1] - 1) < 1e-9 && most < 1e-9);
    }
}

/* ---- energy ---- */

/* A limp robot that is dropped never has more energy than it began with: the ground's own store is
 * its contacts' springs, which only take from it. */
TEST(falls_gain_no_energy) {
    const RobotVariation rigid = rigid_variation();
    const MildTerrain terrain = kit_terrain("rubber");
    const double zero[ROBOT_JOINTS_MAX] = {0};
    double worst = -1, lost = 0;
    const int falls = kit_short() ? 30 : 300;
    int loaded = 0;
    for (int n = 0; n < falls; n++) {
        Robot *robot = robots[n % ROBOTS];
        Random random = random_at(11, (uint32_t)n, 0);
        RobotSim *sim = open_sim(robot, 0.0005);
        RobotState state = {.qpos = {0, 0, 1.2}};
        for (int k = 3; k < 7; k++) {
            state.qpos[k] = random_normal(&random);
        }
        mju_normalize4(state.qpos + 3);
        for (int j = 0; j < robot->def.joints; j++) {
            state.qpos[7 + j] = random_uniform(&random, robot->low[j], robot->high[j]);
        }
        robot_sim_load(sim, &state, &rigid);
        double first = 0, energy = 0;
        for (int s = 0; s < 2400; s++) {
            assert_int_equal(robot_sim_step(sim, zero, NULL, &terrain, NULL), 0);
            mj_energyPos(sim->model, sim->data);
            mj_energyVel(sim->model, sim->data);
            energy = sim->data->energy[0] + sim->data->energy[1];
            first = s == 0 ? energy : first;
            worst = fmax(worst, (energy - first) / first);
            loaded += robot_sim_shell_load(sim) > 0;
        }
        lost += (first - energy) / first / falls;
        robot_sim_destroy(sim);
    }
    print_message("%d falls: energy at most %.4f of the first above it, %.2f lost on average; %d "
                  "steps with shells down\n",
                  falls, worst, lost, loaded);
    assert_true(worst < 0.01 && lost > 0.3 && loaded > 500 * falls);
}

TEST_MAIN(open_robots, close_robots)
