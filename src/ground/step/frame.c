#include "ground/step/frame.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* [-] Mean over the slots of what share of the frame their material asks for. */
static double frame_share(const FootScratch *foot) {
    double sum = 0.0;
    for (int i = 0; i < foot->active; i++) {
        sum += slot_block(foot, i)->projects[i % SLOT_LANES];
    }
    return sum / foot->active;
}

/* Unit normal of the ground, the mean over the slots. */
static void ground_normal(const FootScratch *foot, double n[3]) {
    double x = 0.0, y = 0.0;
    for (int i = 0; foot->uneven && i < foot->active; i++) {
        x -= slot_block(foot, i)->slope_x[i % SLOT_LANES];
        y -= slot_block(foot, i)->slope_y[i % SLOT_LANES];
    }
    x /= foot->active;
    y /= foot->active;
    const double length = sqrt(1.0 + x * x + y * y);
    n[0] = x / length;
    n[1] = y / length;
    n[2] = 1.0 / length;
}

/* The smallest rotation from the unit vector n to e, row major:
 *
 *     1 + [v]x + [v]x^2/(1 + n . e),   v = n x e */
static void rotation_between(const double n[3], const double e[3], double Q[9]) {
    const double v[3] = {n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2],
                         n[0] * e[1] - n[1] * e[0]};
    const double along = n[0] * e[0] + n[1] * e[1] + n[2] * e[2], k = 1.0 / (1.0 + along);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            Q[3 * i + j] = k * v[i] * v[j];
        }
        Q[4 * i] += along;
    }
    Q[1] -= v[2];
    Q[2] += v[1];
    Q[3] += v[2];
    Q[5] -= v[0];
    Q[6] -= v[1];
    Q[7] += v[0];
}

/* b = Q^T a */
static void turn_back(const double Q[9], const double a[3], double b[3]) {
    const double x = a[0], y = a[1], z = a[2];
    for (int k = 0; k < 3; k++) {
        b[k] = Q[k] * x + Q[3 + k] * y + Q[6 + k] * z;
    }
}

static void turn(const double Q[9], const double a[3], double b[3]) {
    const double x = a[0], y = a[1], z = a[2];
    for (int k = 0; k < 3; k++) {
        b[k] = Q[3 * k] * x + Q[3 * k + 1] * y + Q[3 * k + 2] * z;
    }
}

void foot_frame(FootScratch *foot, const double *R) {
    static double c = -1;
    if (c < 0) {
        c = getenv("TURN") ? atof(getenv("TURN")) : FRAME_TURN;
    }
    foot->framed = 0;
    if (foot->shell || !(foot->curves & LAW_HEAP)) {
        return;
    }
    const double share = c * frame_share(foot), side = R[8] < 0.0 ? -1.0 : 1.0;
    double n[3], e[3], square = 0.0, apart = 0.0;
    ground_normal(foot, n);
    for (int k = 0; k < 3; k++) {
        const double d = share * (side * R[3 * k + 2] - n[k]);
        e[k] = n[k] + d;
        square += e[k] * e[k];
        apart += d * d;
    }
    if (!(apart > 0.0)) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        e[k] /= sqrt(square);
    }
    rotation_between(n, e, foot->frame);
    foot->framed = 1;
    for (int k = 0; k < 4; k++) {
        turn_back(foot->frame, foot->arm[k], foot->arm[k]);
    }
}

void frame_from_world(const FootScratch *foot, const double *world, double *own) {
    memmove(own, world, 6 * sizeof *own);
    for (int k = 0; foot->framed && k < 6; k += 3) {
        turn_back(foot->frame, own + k, own + k);
    }
}

void frame_to_world(const FootScratch *foot, const double *own, double *world) {
    memmove(world, own, 6 * sizeof *own);
    for (int k = 0; foot->framed && k < 6; k += 3) {
        turn(foot->frame, world + k, world + k);
    }
}

/* Q^T A Q of the rows and columns of a foot, from number `first` on. */
static void frame_inertia(const FootScratch *foot, double *A, int first, int stride) {
    for (int i = 0; i < stride; i++) {
        frame_from_world(foot, A + i * stride + first, A + i * stride + first);
    }
    for (int i = 0; i < stride; i++) {
        double column[6];
        for (int j = 0; j < 6; j++) {
            column[j] = A[(first + j) * stride + i];
        }
        frame_from_world(foot, column, column);
        for (int j = 0; j < 6; j++) {
            A[(first + j) * stride + i] = column[j];
        }
    }
}

const MildContactInput *contact_in_frames(MildScratch *scratch, const MildContactInput *input) {
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
            frame_from_world(foot, own->free_velocity + 6 * f, own->free_velocity + 6 * f);
            frame_from_world(foot, own->velocity[f], own->velocity[f]);
            frame_inertia(foot, own->inverse_inertia, 6 * scratch->place[f], stride);
        }
    }
    return own;
}
