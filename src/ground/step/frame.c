/* Feet that press in a frame of their own (law/frame.h). */
#include <string.h>

#include "ground/law/frame.h"
#include "ground/law/models.h"
#include "ground/step/step.h"
#include "ground/terrain/terrain.h"

/* side: 1 into the world, -1 into the frame. */
static void vector_turn(const FootScratch *foot, Real side, const double *from, double *to) {
    const Real axis[3] = {side * foot->frame[0], side * foot->frame[1], side * foot->frame[2]};
    Real own[3] = {(Real)from[0], (Real)from[1], (Real)from[2]};
    frame_to_world(axis, own, own);
    for (int k = 0; k < 3; k++) {
        to[k] = own[k];
    }
}

static void twist_turn(const FootScratch *foot, Real side, const double *from, double *to) {
    memmove(to, from, 6 * sizeof *to);
    for (int k = 0; foot->framed && k < 6; k += 3) {
        vector_turn(foot, side, to + k, to + k);
    }
}

void foot_frame(FootScratch *foot, const MildTerrain *terrain, const double *R) {
    const double x = foot->origin[0] + foot->arm[0][0], y = foot->origin[1] + foot->arm[0][1];
    const int material = mild_terrain_material_at(terrain, x, y);
    const Real sole[3] = {(Real)R[2], (Real)R[5], (Real)R[8]};
    double slope[2];
    const MildMaterial *ground = &terrain->materials[material];
    if (foot->shell || !model_row(ground->model)->merged) {
        return;
    }
    terrain_surface(terrain, x, y, slope);
    frame_axis(sole, (Real)slope[0], (Real)slope[1], frame_turn((Real)ground->recovery),
               foot->frame);
    foot->framed = foot->frame[0] != 0 || foot->frame[1] != 0 || foot->frame[2] != 0;
    for (int k = 0; foot->framed && k < 4; k++) {
        vector_turn(foot, -1, foot->arm[k], foot->lever[k]);
    }
}

void twist_of_world(const FootScratch *foot, const double *world, double *own) {
    twist_turn(foot, -1, world, own);
}

void twist_to_world(const FootScratch *foot, const double *own, double *world) {
    twist_turn(foot, 1, own, world);
}

/* Q^T A Q of the rows and columns of a foot, from number `first` on. */
static void inertia_of_world(const FootScratch *foot, double *A, int first, int stride) {
    for (int i = 0; i < stride; i++) {
        twist_of_world(foot, A + i * stride + first, A + i * stride + first);
    }
    for (int i = 0; i < stride; i++) {
        double column[6];
        for (int j = 0; j < 6; j++) {
            column[j] = A[(first + j) * stride + i];
        }
        twist_of_world(foot, column, column);
        for (int j = 0; j < 6; j++) {
            A[(first + j) * stride + i] = column[j];
        }
    }
}

const MildContactInput *input_of_world(MildScratch *scratch, const MildContactInput *input) {
    int framed = 0;
    for (int k = 0; k < scratch->listed; k++) {
        framed |= scratch->foot[scratch->list[k]].framed;
    }
    if (!framed) {
        return input;
    }
    MildContactInput *own = &scratch->input;
    const int stride = 6 * scratch->given;
    *own = *input;
    own->inverse_inertia = scratch->inverse;
    memcpy(scratch->inverse, input->inverse_inertia, (size_t)(stride * stride) * sizeof(double));
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        if (foot->framed) {
            twist_of_world(foot, own->free_velocity + 6 * f, own->free_velocity + 6 * f);
            twist_of_world(foot, own->velocity[f], own->velocity[f]);
            inertia_of_world(foot, own->inverse_inertia, 6 * scratch->place[f], stride);
        }
    }
    return own;
}
