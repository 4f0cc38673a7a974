#include "identify/press_body.h"

#include <math.h>
#include <string.h>

static void cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* out = R m R^T v for a tensor m of the foot frame. */
static void tensor_apply(const double *R, const double *m, const double *v, double *out) {
    double body[3], turned[3];
    for (int i = 0; i < 3; i++) {
        body[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2];
    }
    for (int i = 0; i < 3; i++) {
        turned[i] = m[3 * i] * body[0] + m[3 * i + 1] * body[1] + m[3 * i + 2] * body[2];
    }
    for (int i = 0; i < 3; i++) {
        out[i] = R[3 * i] * turned[0] + R[3 * i + 1] * turned[1] + R[3 * i + 2] * turned[2];
    }
}

/* The body is flat. Every element is a square of mass/count, so I_zz = I_xx + I_yy and z does not
 * couple. */
PressBody press_body(const MildSole *sole, double mass) {
    const double *x = mild_sole_x(sole), *y = mild_sole_y(sole), pitch = mild_sole_pitch(sole);
    int count = mild_sole_elements(sole);
    double share = mass / count, own = mass * pitch * pitch / 12, cx = 0, cy = 0, xx = own,
           yy = own, xy = 0;
    for (int i = 0; i < count; i++) {
        cx += x[i] / count;
        cy += y[i] / count;
    }
    for (int i = 0; i < count; i++) {
        xx += share * (y[i] - cy) * (y[i] - cy);
        yy += share * (x[i] - cx) * (x[i] - cx);
        xy -= share * (x[i] - cx) * (y[i] - cy);
    }
    double det = xx * yy - xy * xy, zz = xx + yy;
    return (PressBody){.mass = mass,
                       .center = {cx, cy, mild_sole_z(sole)},
                       .inertia = {xx, xy, 0, xy, yy, 0, 0, 0, zz},
                       .inverse = {yy / det, -xy / det, 0, -xy / det, xx / det, 0, 0, 0, 1 / zz}};
}

/* Vector from the ankle to the centre of mass, world. */
static void body_center(const PressBody *body, const double *R, double *r) {
    const double *c = body->center;
    for (int k = 0; k < 3; k++) {
        r[k] = R[3 * k] * c[0] + R[3 * k + 1] * c[1] + R[3 * k + 2] * c[2];
    }
}

/* Column k of A: the twist that a unit wrench at the ankle gives; a = F/m - alpha x r, alpha = I^-1
 * (tau - r x F). */
static void body_inverse_inertia(const PressBody *body, const double *R, const double *r,
                                 double *A) {
    for (int k = 0; k < 6; k++) {
        double wrench[6] = {0}, lever[3], torque[3], turn[3], swing[3];
        wrench[k] = 1;
        cross(r, wrench, lever);
        for (int j = 0; j < 3; j++) {
            torque[j] = wrench[3 + j] - lever[j];
        }
        tensor_apply(R, body->inverse, torque, turn);
        cross(turn, r, swing);
        for (int j = 0; j < 3; j++) {
            A[6 * j + k] = wrench[j] / body->mass - swing[j];
            A[6 * (3 + j) + k] = turn[j];
        }
    }
}

/* Free: the centre falls, alpha = -I^-1 (omega x I omega), and the ankle's acceleration is
 * g - alpha x r - omega x (omega x r). */
void press_body_free(const PressBody *body, double gravity, MildContactInput *input) {
    const double *R = input->rotation[0], *V = input->velocity[0], *spin = V + 3;
    double r[3], moment[3], gyro[3], turn[3], swing[3], along[3], centripetal[3];
    body_center(body, R, r);
    body_inverse_inertia(body, R, r, input->inverse_inertia);
    tensor_apply(R, body->inertia, spin, moment);
    cross(moment, spin, gyro); /* -omega x I omega */
    tensor_apply(R, body->inverse, gyro, turn);
    cross(turn, r, swing);
    cross(spin, r, along);
    cross(spin, along, centripetal);
    for (int k = 0; k < 3; k++) {
        double acceleration = -(k == 2 ? gravity : 0) - swing[k] - centripetal[k];
        input->free_velocity[k] = V[k] + input->dt * acceleration;
        input->free_velocity[3 + k] = V[3 + k] + input->dt * turn[k];
    }
}

/* R <- exp([dt omega]x) R by Rodrigues' formula. */
static void turn_by(double *R, const double *spin, double dt) {
    double rate = sqrt(spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]),
           angle = rate * dt;
    if (angle == 0) {
        return;
    }
    double x = spin[0] / rate, y = spin[1] / rate, z = spin[2] / rate, c = cos(angle),
           s = sin(angle), t = 1 - c;
    const double Q[9] = {t * x * x + c,     t * x * y - s * z, t * x * z + s * y,
                         t * x * y + s * z, t * y * y + c,     t * y * z - s * x,
                         t * x * z - s * y, t * y * z + s * x, t * z * z + c};
    double out[9];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = Q[3 * i] * R[j] + Q[3 * i + 1] * R[3 + j] + Q[3 * i + 2] * R[6 + j];
        }
    }
    memcpy(R, out, sizeof out);
}

void press_body_move(MildContactInput *input, const double *velocity) {
    memcpy(input->velocity[0], velocity, sizeof input->velocity[0]);
    for (int k = 0; k < 3; k++) {
        input->position[0][k] += input->dt * velocity[k];
    }
    turn_by(input->rotation[0], velocity + 3, input->dt);
}
