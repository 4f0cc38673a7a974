/* Plates that are the soles of one robot. They move as rigid bodies on the robot's own inertia:
 *
 *     dV/dt = a + A F(t)
 *
 * with the twists V of all soles, their accelerations a without ground, the wrenches F, and the
 * inverse inertia A that the robot has there, both constant over one of the robot's steps T. So
 * after it V = V_free + T A F_mean, which is the robot's velocity when it is given the mean wrench:
 * neither force nor momentum is late. */
#ifndef GRAINS_RIDE_H
#define GRAINS_RIDE_H

#include "grains.h"

enum : int { RIDE_ROWS = 6 * RANGE_BEDS };

struct Ride {
    double place[3 * RANGE_BEDS]; /* of the origins [m]; z from the floor, the box's middle is 0 */
    double turn[4 * RANGE_BEDS];  /* orientation, w x y z */
    double twist[RIDE_ROWS];      /* V: of the origin, then spin [m/s, rad/s] */
    double shift[RIDE_ROWS];      /* besides moves the plates to where the robot has them */
    double free[RIDE_ROWS];       /* a [m/s^2, rad/s^2] */
    double response[RIDE_ROWS * RIDE_ROWS]; /* A, rows of all plates */
    long long before[RIDE_ROWS];            /* the plates' sums before this step */
};

BOTH void ride_turn(double *q, const double *spin, double dt) {
    const double x = 0.5 * dt * spin[0], y = 0.5 * dt * spin[1], z = 0.5 * dt * spin[2];
    const double w = q[0], a = q[1], b = q[2], c = q[3];
    q[0] = w - x * a - y * b - z * c;
    q[1] = a + x * w + y * c - z * b;
    q[2] = b - x * c + y * w + z * a;
    q[3] = c + x * b - y * a + z * w;
    const double size = 1 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) {
        q[k] *= size;
    }
}

/* What grains feel of plate b. */
BOTH void ride_place(const Ride &r, int b, const Grains &g, Plate *p) {
    const double *at = r.place + 3 * b, *q = r.turn + 4 * b;
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double turn[9] = {
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
        2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    float v[6];
    plate_cells(p, g, at[0], at[1], at[2]);
    for (int k = 0; k < 9; k++) {
        p->turn[k] = (float)turn[k];
    }
    for (int k = 0; k < 6; k++) {
        v[k] = (float)(r.twist[6 * b + k] + r.shift[6 * b + k]);
    }
    p->velocity = vec(v[0], v[1], v[2]);
    p->spin = vec(v[3], v[4], v[5]);
}

/* Of all plates, by one thread: after grain_step, whose forces it takes. */
DEVICE void ride_step(int, const Grains &g) {
    Ride *r = g.ride;
    const int rows = 6 * g.beds;
    const double dt = (double)g.law.dt;
    double force[RIDE_ROWS];
    for (int i = 0; i < rows; i++) {
        const long long sum = g.plate[i / 6].sum[i % 6];
        force[i] = (double)(sum - r->before[i]) / (double)(1 << SUM_BITS);
        r->before[i] = sum;
    }
    for (int i = 0; i < rows; i++) {
        double faster = r->free[i];
        for (int j = 0; j < rows; j++) {
            faster += r->response[i * rows + j] * force[j];
        }
        r->twist[i] += dt * faster;
    }
    for (int b = 0; b < g.beds; b++) {
        double v[6];
        for (int k = 0; k < 6; k++) {
            v[k] = r->twist[6 * b + k] + r->shift[6 * b + k];
        }
        for (int k = 0; k < 3; k++) {
            r->place[3 * b + k] += dt * v[k];
        }
        ride_turn(r->turn + 4 * b, v + 3, dt);
        ride_place(*r, b, g, &g.plate[b]);
    }
}

#endif
