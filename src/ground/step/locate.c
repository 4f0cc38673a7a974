#include "ground/step/locate.h"

#include <string.h>

#include "ground/terrain/terrain.h"

#define LISTED_MARGIN 1e-3 /* [m] elements this close to the ground are listed */
/* [m/s] Allowance for an impact at the heel, which may swing the toe down faster than its free
 * motion. */
#define LISTED_EXTRA_SPEED 2.0

Motion foot_motion(const FootScratch *foot, const double *V) {
    return foot_moves(foot, V);
}

void foot_surface(FootScratch *foot, const MildTerrain *terrain) {
    for (int i = 0; i < foot->padded; i++) {
        double slope[2];
        foot->depth[i] =
            terrain_surface(terrain, foot->point_x[i], foot->point_y[i], slope) - foot->point_z[i];
        foot->slope_x[i] = slope[0];
        foot->slope_y[i] = slope[1];
    }
}

void foot_set_pose(FootScratch *foot, const MildTerrain *terrain, const double *position,
                   const double *R) {
    for (int k = 0; k < 3; k++) {
        foot->origin[k] = position[k];
        foot->arm[0][k] = R[3 * k + 2] * foot->z;
        foot->arm[1][k] = R[3 * k];
        foot->arm[2][k] = R[3 * k + 1];
        foot->arm[3][k] = R[3 * k + 2];
    }
    foot->uneven = !terrain_is_level(terrain);
    foot->away = 0;
    foot->framed = 0;
    memset(foot->frame, 0, sizeof foot->frame);
    memcpy(foot->lever, foot->arm, sizeof foot->lever);
}

void foot_locate(FootScratch *foot, const MildTerrain *terrain, int imprints) {
    if (foot->uneven || imprints || !terrain_is_uniform(terrain)) {
        foot_points(foot);
    }
    if (foot->uneven) {
        foot_surface(foot, terrain);
    } else {
        const double *x = foot->x;
        const double *y = foot->y;
        const double ez = foot->arm[1][2];
        const double nz = foot->arm[2][2];
        const double above = terrain->height - foot->origin[2] - foot->arm[0][2];
        double *depth = foot->depth;
#pragma omp simd
        for (int i = 0; i < foot->padded; i++) {
            depth[i] = above - ez * x[i] - nz * y[i];
        }
    }
    for (int i = foot->elements; i < foot->padded; i++) {
        foot->depth[i] = PADDING_DEPTH;
    }
}

/* Upper bound [m/s] on the speed at which any point of the foot gets deeper under the twist V.
 * steepest: upper bound [-] on the gradient of the ground. */
static double foot_descent(const FootScratch *foot, const double *V, double steepest) {
    const double tilt = V[3] * V[3] + V[4] * V[4];
    const double level = sqrt(V[0] * V[0] + V[1] * V[1]);
    return real_max(-V[2], 0.0) + foot->radius * sqrt(tilt) +
           steepest * (level + foot->radius * sqrt(tilt + V[5] * V[5]));
}

double foot_least(const FootScratch *foot, const MildContactInput *input, double steepest, int f) {
    const double descent = real_max(foot_descent(foot, input->velocity[f], steepest),
                                    foot_descent(foot, input->free_velocity + 6 * f, steepest));
    return -LISTED_MARGIN - input->dt * (descent + LISTED_EXTRA_SPEED);
}

/* [m] Upper bound on the depth of any element: its bounding box against the ground under its middle
 * and the steepest slope from there. */
static double foot_reach(const FootScratch *foot, const MildTerrain *terrain, double steepest) {
    double at[3], low = 0.0, reach = 0.0, slope[2];
    for (int k = 0; k < 3; k++) {
        at[k] = foot->origin[k];
        for (int j = 0; j < 3; j++) {
            at[k] += foot->arm[1 + j][k] * foot->middle[j];
        }
        low += fabs(foot->arm[1 + k][2]) * foot->half[k];
        reach += foot->half[k] * foot->half[k];
    }
    const double height =
        foot->uneven ? terrain_surface(terrain, at[0], at[1], slope) + steepest * sqrt(reach)
                     : terrain->height;
    return height - at[2] + low;
}

int foot_is_away(FootScratch *foot, const MildTerrain *terrain, const MildContactInput *input,
                 double steepest, int f) {
    foot->least = foot_least(foot, input, steepest, f);
    foot->reach = foot_reach(foot, terrain, steepest);
    foot->away = foot->reach <= foot->least;
    return foot->away;
}

void foot_list(FootScratch *foot, const MildContactInput *input, double steepest, int f) {
    const double least = foot_least(foot, input, steepest, f);
    const double *depth = foot->depth;
    double near = 0.0;
    /* Count whole vectors, unless that would count the padding. */
    const int end = least < PADDING_DEPTH ? foot->elements : foot->padded;
#pragma omp simd reduction(+ : near)
    for (int i = 0; i < end; i++) {
        near += depth[i] > least ? 1.0 : 0.0;
    }
    foot->active = (int)near;
    const int all = foot->active == foot->elements;
    if (foot->active == 0 || (all && foot->whole)) {
        return;
    }
    int active = 0;
    for (int i = 0; i < foot->elements; i++) {
        foot->element[active] = i;
        active += all | (foot->depth[i] > least);
    }
    foot->whole = all;
}
