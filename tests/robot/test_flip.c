/* Why the ground is solved inside the step. A soil force that is computed from the depth and the
 * speed at the start of a step and applied to the feet as an outside force, as one does in a
 * simulator without soft ground, throws the robot over (IsaacLab issue 1661); the same element law,
 * solved with the step, carries it. Both robots stand under the same controller, the engine
 * integrates both. */
#include <math.h>
#include <string.h>

#include "robot_kit.h"

#include <mujoco/mujoco.h>

#include "sa01.h"

#define SECONDS 20.0
#define DT 0.005        /* [s] */
#define TILT_LIMIT 1.0  /* [rad] of the base: fallen */
#define SPEED_LIMIT 1e3 /* [m/s, rad/s] beyond: the numbers went bad */
#define SLIP_SPEED 0.01 /* [m/s] width of the explicit friction's stick region */

typedef struct {
    int stands;
    double seconds; /* [s] until it fell, or all */
    double shake;   /* [rad/s] fastest joint in the last second that it stood upright */
} Standing;

typedef struct {
    MildMaterial material;
    MildTerrain terrain;
    MildGround *ground; /* NULL: the soil force is explicit */
    RobotSim *sim;
} Case;

/* Newton's second law's right hand side: every element's F_g + c_d m_a' w^2 and its friction, now,
 * about the ankle. */
static void soil_wrench(const MildMaterial *material, const MildSole *sole, const RobotFoot *foot,
                        double wrench[6]) {
    const double *R = foot->rotation, *V = foot->velocity, *W = foot->velocity + 3;
    memset(wrench, 0, 6 * sizeof *wrench);
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        double x = mild_sole_x(sole)[i], y = mild_sole_y(sole)[i], z = mild_sole_z(sole), p[3],
               v[3], force[3];
        for (int k = 0; k < 3; k++) {
            p[k] = R[3 * k] * x + R[3 * k + 1] * y + R[3 * k + 2] * z;
        }
        for (int k = 0; k < 3; k++) {
            v[k] = V[k] + W[(k + 1) % 3] * p[(k + 2) % 3] - W[(k + 2) % 3] * p[(k + 1) % 3];
        }
        double depth = -(foot->position[2] + p[2]), down = fmax(-v[2], 0.0);
        if (!(depth > 0.0)) {
            continue;
        }
        MildElementLaw law = mild_element_law(material, mild_sole_pitch(sole), depth);
        force[2] = law.force + material->c_d * law.added_mass_per_depth * down * down;
        double friction = material->mu * force[2] / fmax(hypot(v[0], v[1]), SLIP_SPEED);
        force[0] = -friction * v[0];
        force[1] = -friction * v[1];
        for (int k = 0; k < 3; k++) {
            wrench[k] += force[k];
            wrench[3 + k] +=
                p[(k + 1) % 3] * force[(k + 2) % 3] - p[(k + 2) % 3] * force[(k + 1) % 3];
        }
    }
}

/* xfrc_applied acts at a body's centre of mass. */
static void apply_wrench(const mjModel *m, mjData *d, const char *body_name,
                         const double wrench[6]) {
    int body = mj_name2id(m, mjOBJ_BODY, body_name);
    double arm[3], *applied = d->xfrc_applied + 6 * body;
    for (int k = 0; k < 3; k++) {
        arm[k] = d->xipos[3 * body + k] - d->xpos[3 * body + k];
    }
    memcpy(applied, wrench, 6 * sizeof *wrench);
    for (int k = 0; k < 3; k++) {
        applied[3 + k] -=
            arm[(k + 1) % 3] * wrench[(k + 2) % 3] - arm[(k + 2) % 3] * wrench[(k + 1) % 3];
    }
}

/* mj_step with the soil's force as an outside force, as a user writes it. */
static void explicit_step(const Case *one, const double *torque) {
    static const char *const feet[SA01_FEET] = {"leg_l6_link", "leg_r6_link"};
    mjModel *m = robot_sim_model(one->sim);
    mjData *d = robot_sim_data(one->sim);
    m->opt.disableflags |= mjDSBL_CONTACT;
    memcpy(d->qfrc_applied + 6, torque, SA01_JOINTS * sizeof *torque);
    for (int f = 0; f < SA01_FEET; f++) {
        double wrench[6];
        soil_wrench(&one->material, robot_soles(robot)[f], robot_sim_foot(one->sim, f), wrench);
        apply_wrench(m, d, feet[f], wrench);
    }
    mj_step(m, d);
    RobotState state;
    RobotVariation nominal = robot_variation_nominal();
    robot_sim_store(one->sim, &state);
    robot_sim_load(one->sim, &state, &nominal); /* what the controller looks at */
}

static void case_open(Case *one, const char *name, double dt, int explicit_soil) {
    const MildSole *const *soles = robot_soles(robot);
    *one = (Case){kit_preset(name), kit_terrain(name), explicit_soil ? NULL : kit_ground(robot),
                  new_sim(dt)};
    double sinkage = mild_sole_sinkage(soles[0], &one->material, robot_foot_load(robot));
    RobotState state = stand_state(stand, 1, sinkage);
    RobotVariation nominal = robot_variation_nominal();
    robot_sim_load(one->sim, &state, &nominal);
}

static Standing stand_still(const char *name, double dt, int explicit_soil) {
    Case one;
    case_open(&one, name, dt, explicit_soil);
    Standing result = {.stands = 1};
    int window = 0;
    double fastest[2] = {0}; /* in the present second and in the one before */
    for (int i = 0; i < (int)(SECONDS / dt + 0.5) && result.stands; i++) {
        double torque[SA01_JOINTS];
        stand_torque(stand, one.sim, 1, torque);
        int bad = one.ground ? robot_sim_step(one.sim, torque, NULL, &one.terrain, one.ground) : 0;
        if (!one.ground) {
            explicit_step(&one, torque);
        }
        result.seconds = (i + 1) * dt;
        if ((int)result.seconds > window) {
            window = (int)result.seconds;
            fastest[1] = fastest[0];
            fastest[0] = 0.0;
        }
        for (int k = 0; k < SA01_NV; k++) {
            double speed = fabs(robot_sim_qvel(one.sim)[k]);
            bad |= !(speed < SPEED_LIMIT);
            fastest[0] = k >= 6 ? fmax(fastest[0], speed) : fastest[0];
        }
        result.stands = !bad && robot_sim_base_rotation(one.sim)[8] > cos(TILT_LIMIT);
    }
    result.shake = fastest[1];
    free(one.ground);
    robot_sim_destroy(one.sim);
    return result;
}

/* The largest of the steps [s] at which the explicit force lets the robot stand. */
static double largest_step(const char *name) {
    static const double steps[] = {0.005, 0.004, 0.003, 0.0025, 0.002, 0.0015, 0.001, 0.0005};
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++) {
        if (stand_still(name, steps[s], 1).stands) {
            return steps[s];
        }
    }
    return 0.0;
}

TEST(test_explicit_soil_flips) {
    int fallen = 0;
    for (int p = 0; p < PAPER_PRESETS; p++) {
        const char *name = mild_material_preset_name(p);
        Standing outside = stand_still(name, DT, 1), ours = stand_still(name, DT, 0);
        print_message("%-11s %g ms: explicit %s %5.2f s, joints at %7.3f rad/s, stands up to %g "
                      "ms; ours %s %g s, %.0e rad/s\n",
                      name, 1e3 * DT, outside.stands ? "stands" : "falls after", outside.seconds,
                      outside.shake, 1e3 * largest_step(name),
                      ours.stands ? "stands" : "falls after", ours.seconds, ours.shake);
        assert_true(ours.stands);
        assert_true(outside.shake > 10.0 * ours.shake); /* where it does not fall it chatters */
        fallen += !outside.stands;
        if (strcmp(name, "foam45") == 0 || strcmp(name, "sand_loose") == 0) {
            assert_false(outside.stands);
        }
    }
    print_message("the explicit force fells the robot on %d of %d grounds\n", fallen,
                  PAPER_PRESETS);
}

TEST_MAIN(setup, teardown)
