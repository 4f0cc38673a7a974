/* What a task asks of a robot's pose, as RobotSim answers it: valid after engine_begin, until
 * engine_end. Points are in world axes and count from the world's origin. */
#ifndef MILD_ENGINE_MEASURE_H
#define MILD_ENGINE_MEASURE_H

#include "robot/engine/ground.h"

#define MEASURE_NONE REAL(1e9) /* [m] where there is nothing to measure */

/* [m] A point of a foot's body. */
MILD_HD void foot_body_point(const EngineWork *work, int foot, Real x, Real y, Real z,
                             Real *point) {
    const Real at[3] = {x, y, z};
    turn3(work->foot_rotation[foot], at, point);
    for (int k = 0; k < 3; k++) {
        point[k] += work->foot_position[foot][k];
    }
}

/* [m] Point i of the outline of a flat sole. */
MILD_HD void sole_point(const EngineModel *model, const EngineWork *work, int foot, int i,
                        Real *point) {
    const EngineFoot *of = &model->number.foot[foot];
    foot_body_point(work, foot, of->outline[2 * i], of->outline[2 * i + 1], of->center[2], point);
}

/* [m, m/s] Centre of a sole, and its velocity. */
MILD_HD void sole_center(const EngineModel *model, const EngineWork *work, int foot, Real *center,
                         Real *velocity) {
    const EngineFoot *of = &model->number.foot[foot];
    const Real *twist = work->foot_velocity[foot];
    Real arm[3];
    foot_body_point(work, foot, of->center[0], of->center[1], of->center[2], center);
    for (int k = 0; k < 3; k++) {
        arm[k] = center[k] - work->foot_position[foot][k];
        velocity[k] = twist[k];
    }
    add_cross3(twist + 3, arm, velocity);
}

/* [m] Lowest point of a shell, and the point under its centre, from the base's origin. */
MILD_HD Real shell_lowest(const EngineModel *model, const EngineWork *work, int s, Real *under) {
    const EngineShell *shell = &model->number.shell[s];
    const int link = model->tree.shell_link[s];
    const Real *R = work->rotation[link];
    Real center[3];
    turn3(R, shell->center, center);
    for (int k = 0; k < 3; k++) {
        center[k] += work->position[link][k];
    }
    Real low = work->base[2] + center[2] - shell->radius;
    for (int k = 0; k < 3; k++) {
        const Real up = R[6] * shell->rotation[k] + R[7] * shell->rotation[3 + k] +
                        R[8] * shell->rotation[6 + k];
        low -= REAL_ABS(up) * shell->half[k];
    }
    under[0] = center[0];
    under[1] = center[1];
    return low;
}

/* [m] Least height of a shell's lowest point above the ground under its centre. */
typedef struct {
    Real body; /* of all shells */
    Real base; /* of those of the base and of what is welded to it */
} EngineClearance;

WARP_FN EngineClearance engine_clearance_on(const EngineModel *model, const EngineWork *work,
                                            const EngineGround *ground) {
    Real most[LANE_COPIES];
    Real base[LANE_COPIES];
    EACH_LANE(l) {
        const MapSpot spot = engine_spot(ground, work);
        most[l] = base[l] = -MEASURE_NONE;
        LANE_ROLLED
        for (int s = LANE(l); s < model->tree.shells; s += LANES) {
            Real under[2];
            const Real low = shell_lowest(model, work, s, under);
            const EngineSurface surface = engine_surface(ground, work, &spot, under[0], under[1]);
            most[l] = real_max(most[l], surface.height - low);
            base[l] = model->tree.shell_link[s] ? base[l] : real_max(base[l], surface.height - low);
        }
    }
    const EngineClearance clearance = {-lane_max(most), -lane_max(base)};
    return clearance;
}

WARP_FN Real engine_body_clearance_on(const EngineModel *model, const EngineWork *work,
                                      const EngineGround *ground) {
    return engine_clearance_on(model, work, ground).body;
}

/* [m] Height of a point of the world below the ground there. */
MILD_HD Real point_depth(const EngineGround *ground, const EngineWork *work, const MapSpot *spot,
                         const Real *point) {
    const EngineSurface surface =
        engine_surface(ground, work, spot, point[0] - work->base[0], point[1] - work->base[1]);
    return surface.height - point[2];
}

/* [m] Least height of a point of a sole's outline above the ground under it; of a round foot that
 * of its reference point. */
WARP_FN Real engine_sole_height_on(const EngineModel *model, const EngineWork *work, int foot,
                                   const EngineGround *ground) {
    Real most[LANE_COPIES];
    EACH_LANE(l) {
        const MapSpot spot = engine_spot(ground, work);
        most[l] = model->tree.outline_points[foot]
                      ? -MEASURE_NONE
                      : point_depth(ground, work, &spot, work->foot_position[foot]);
        LANE_ROLLED
        for (int i = LANE(l); i < model->tree.outline_points[foot]; i += LANES) {
            Real point[3];
            sole_point(model, work, foot, i, point);
            most[l] = real_max(most[l], point_depth(ground, work, &spot, point));
        }
    }
    return -lane_max(most);
}

/* [m] Of b beyond a along the base's lateral axis laid level, to the left. */
MILD_HD Real lateral_distance(const EngineWork *work, const Real *a, const Real *b) {
    const Real x = work->rotation[0][0];
    const Real y = work->rotation[0][3];
    const Real length = REAL_SQRT(x * x + y * y);
    return length < REAL(1e-9) ? 0 : (x * (b[1] - a[1]) - y * (b[0] - a[0])) / length;
}

/* [m] Least lateral distance between mirrored knees, negative when the legs are crossed. */
MILD_HD Real knee_distance(const EngineModel *model, const EngineWork *work) {
    Real least = MEASURE_NONE;
    LANE_ROLLED
    for (int p = 0; p < model->tree.pairs; p++) {
        Real knee[2][3];
        for (int n = 0; n < 2; n++) {
            const int f = model->tree.pair[p][n];
            const int link = model->tree.knee_link[f];
            turn3(work->rotation[link], model->number.foot[f].knee, knee[n]);
            for (int k = 0; k < 3; k++) {
                knee[n][k] += work->position[link][k];
            }
        }
        least = real_min(least, lateral_distance(work, knee[1], knee[0]));
    }
    return least;
}

/* [m] The same between the centres of mirrored soles. */
MILD_HD Real foot_distance(const EngineModel *model, const EngineWork *work) {
    Real least = MEASURE_NONE;
    LANE_ROLLED
    for (int p = 0; p < model->tree.pairs; p++) {
        Real center[2][3];
        Real velocity[3];
        for (int n = 0; n < 2; n++) {
            sole_center(model, work, model->tree.pair[p][n], center[n], velocity);
        }
        least = real_min(least, lateral_distance(work, center[1], center[0]));
    }
    return least;
}

#endif
