/* Velocity field of a foot. The element at (x, y) in the foot frame has the velocity
 *
 *     v_x = x[0] + x[1] x + x[2] y
 *
 * along the x axis of the world, and likewise along y and z. */
#ifndef MILD_GROUND_MOTION_H
#define MILD_GROUND_MOTION_H

typedef struct {
    double x[3]; /* [m/s], [1/s], [1/s] */
    double y[3]; /* the same */
    double z[3]; /* the same */
} Motion;

/* One component at a point. */
static inline double motion_at(const double m[3], double x, double y) {
    return m[0] + m[1] * x + m[2] * y;
}

#endif
