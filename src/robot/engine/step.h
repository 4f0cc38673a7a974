/* One physics step of a robot, as a warp takes it:
 *
 *     engine_load(model, qpos, qvel, work);        once
 *     for each step:
 *         engine_begin(model, &action, work);      up to A and V_free
 *         soft ground: from the feet's pose, A and V_free to work->wrench
 *         rigid ground: engine_collide(model, rigid, surface, level, work), the corners, or
 *             engine_collide_on(model, rigid, ground, work), the same on a map
 *         bad |= engine_end(model, rigid, work);   limits and corners, then the next state
 *     engine_store(model, work, qpos, qvel);       once
 *
 * The ground reads work->foot_position, foot_rotation, foot_velocity, now.support.free_velocity and
 * now.support.ground.inverse_inertia, in the layout of ContactProblem, and writes work->wrench, all
 * of it, zeros for feet in the air. Nothing else passes between the two. After a step the state is
 * new and poses are those of its beginning; engine_begin without an action brings them up to date
 * for an observer (measure.h).
 *
 * Loops are rolled but for the shortest ones: a GPU reads its instructions from a small cache, and
 * a step executes most of them once. */
#ifndef MILD_ENGINE_STEP_H
#define MILD_ENGINE_STEP_H

#include "robot/engine/constraint.h"
#include "robot/engine/dynamics.h"
#include "robot/engine/kinematics.h"
#include "robot/engine/legs.h"

#define ENGINE_RATE_MAX 1000 /* [m/s, rad/s] beyond: the numbers went bad */

MILD_HD void unit_quaternion(const Real *q, Real *unit) {
    const Real norm = REAL_SQRT(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) {
        unit[k] = q[k] / norm;
    }
}

/* From the order of RobotState, qpos [7 + joints] and qvel [6 + joints], to the tree's, as if the
 * robot had not accelerated before. */
WARP_FN void engine_load(const EngineModel *model, const Real *qpos, const Real *qvel,
                         EngineWork *work) {
    const EngineTree *tree = &model->tree;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < engine_links(tree); i += LANES) {
            work->angle[i] = i ? qpos[7 + tree->joint[i]] : 0;
            work->limit_side[i] = 0;
        }
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            work->rate[d] = qvel[d < 6 ? d : 6 + tree->joint[d - 5]];
            work->acceleration[d] = 0;
        }
        for (int k = LANE(l); k < 3; k += LANES) {
            work->base[k] = qpos[k];
        }
        if (LANE(l) == 0) {
            unit_quaternion(qpos + 3, work->quaternion);
        }
    }
    lanes_sync();
}

WARP_FN void engine_store(const EngineModel *model, const EngineWork *work, Real *qpos,
                          Real *qvel) {
    const EngineTree *tree = &model->tree;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < engine_links(tree); i += LANES) {
            if (i) {
                qpos[7 + tree->joint[i]] = work->angle[i];
            }
        }
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            qvel[d < 6 ? d : 6 + tree->joint[d - 5]] = work->rate[d];
        }
        for (int k = LANE(l); k < 4; k += LANES) {
            qpos[3 + k] = work->quaternion[k];
            if (k < 3) {
                qpos[k] = work->base[k];
            }
        }
    }
    lanes_sync();
}

/* What acts on a robot in a step. */
typedef struct {
    const EngineVariation *variation;
    const Real *torque; /* [joints] [N m] in the order of robot.ini */
    const Real *push;   /* [6] [N, N m] at the base's centre of mass, world axes, or NULL */
    int rigid;          /* bool: on rigid ground */
} EngineAction;

/* M, and the forces without ground and constraints f in work->acceleration. After
 * engine_kinematics. */
WARP_FN void engine_smooth_dynamics(const EngineModel *model, const EngineAction *action,
                                    EngineWork *work) {
    engine_link_forces(model, action->variation, work);
    engine_gather(&model->tree, work);
    engine_smooth_force(model, action->variation, action->torque, action->push, work);
    engine_mass_matrix(model, action->variation, work);
}

/* The factor of M, or of N with limits that are held, and half of the way to the acceleration,
 * which engine_accelerate goes on with: L^-T f. */
WARP_FN void engine_smooth_acceleration(const EngineTree *tree, EngineWork *work) {
    engine_factorise(tree, work->mass[0], work->factor[0], work->inverse);
    engine_solve_transposed(tree, work->factor[0], work->inverse, work->acceleration);
}

/* Poses and twists of links and feet; with an action also what engine_end needs, and what soft
 * ground asks for. */
WARP_FN void engine_begin(const EngineModel *model, const EngineAction *action, EngineWork *work) {
    engine_kinematics(model, work);
    if (action) {
        engine_limits_predict(model, work, action->rigid);
        engine_smooth_dynamics(model, action, work);
        if (limit_held(work, 0)) {
            engine_limits_hold(&model->tree, work);
        }
        engine_smooth_acceleration(&model->tree, work);
        engine_legs_push(model, work);
    }
    engine_feet_pose(model, work);
    if (action && !action->rigid) {
        engine_project_feet(model, work);
    }
}

/* The base's quaternion after turning by the vector `turn` [rad] in base axes. */
MILD_HD void turn_quaternion(Real *q, const Real *turn) {
    const Real square = dot3(turn, turn);
    const Real angle = REAL_SQRT(square);
    Real sine;
    Real w;
    real_sine_cosine(angle / 2, &sine, &w);
    const Real scale = angle > 0 ? sine / angle : REAL(0.5);
    const Real v[3] = {scale * turn[0], scale * turn[1], scale * turn[2]};
    const Real next[4] = {q[0] * w - q[1] * v[0] - q[2] * v[1] - q[3] * v[2],
                          q[0] * v[0] + q[1] * w + q[2] * v[2] - q[3] * v[1],
                          q[0] * v[1] + q[2] * w + q[3] * v[0] - q[1] * v[2],
                          q[0] * v[2] + q[3] * w + q[1] * v[1] - q[2] * v[0]};
    unit_quaternion(next, q);
}

/* Semi-implicit Euler: velocity first, then the pose with the new velocity. Returns 1, and leaves
 * the pose, when a velocity went bad. */
WARP_FN int engine_integrate(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    const Real dt = model->number.dt;
    Real bad[LANE_COPIES];
    EACH_LANE(l) {
        bad[l] = 0;
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            work->rate[d] += dt * work->acceleration[d];
            bad[l] = REAL_ABS(work->rate[d]) < ENGINE_RATE_MAX ? bad[l] : 1; /* NaN included */
        }
    }
    lanes_sync();
    if (lane_max(bad) > 0) {
        return 1;
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < engine_links(tree); i += LANES) {
            work->angle[i] += i ? dt * work->rate[5 + i] : 0;
        }
        for (int k = LANE(l); k < 3; k += LANES) {
            work->base[k] += dt * work->rate[k];
        }
        if (LANE(l) == 0) {
            const Real turn[3] = {dt * work->rate[3], dt * work->rate[4], dt * work->rate[5]};
            turn_quaternion(work->quaternion, turn);
        }
    }
    lanes_sync();
    return 0;
}

/* qacc on rigid ground with shells in it, and the wrenches of feet and bodies, after
 * engine_collide_on and engine_floor_collide: engine_end without the next state. */
WARP_FN void engine_floor_solve(const EngineModel *model, EngineFloor *floor, EngineWork *work) {
    engine_accelerate(&model->tree, work, 0);
    engine_limits_make(model, work);
    const int newton = engine_constrain(&model->tree, work, floor, 1);
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            work->newton = newton;
        }
    }
    lanes_sync();
}

/* The wrenches of soft ground, or rigid ground where engine_collide was called; limits; the next
 * state. Returns 1 when a velocity went bad. */
WARP_FN int engine_end(const EngineModel *model, int rigid, EngineWork *work) {
    engine_accelerate(&model->tree, work, !rigid);
    int newton = 0;
    if (rigid || limit_held(work, 0)) {
        engine_limits_make(model, work); /* anew: engine_save leaves them out */
        newton = rigid || !engine_held_push(&model->tree, work)
                     ? engine_constrain(&model->tree, work, NULL, rigid)
                     : 0;
    }
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            work->newton = newton;
        }
    }
    lanes_sync();
    return engine_integrate(model, work);
}

#endif
