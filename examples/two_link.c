/* A hand-written robot: a two-link leg whose hip slides on a vertical rail drops onto foam and
 * squats there. q = (z, a, b): height of the hip [m], angles of thigh and shank about +y, 0
 * straight down [rad] point(s, t) = hip - s (sin a, cos a) - t (sin b, cos b)     (x, z), s along
 * the thigh, t along the shank [m] One function gives the Jacobian of such a point; M (of point
 * masses), h and the foot's J are made of it. The ground needs A = J M^-1 J^T (6 x 6, here of rank
 * 3) and v_free = J (qd + dt M^-1 (tau - h)), and gives force and torque. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "mild/ground.h"

static const double gravity = 9.81, dt = 0.001, thigh = 0.3, shank = 0.3, ankle = 0.03,
                    crouch = 0.5; /* SI */
static const double masses[4][3] = {
    {0, 0, 8}, {0.15, 0, 2}, {0.3, 0.15, 1.5}, {0.3, 0.3, 0.5}}; /* s, t [m], [kg] */

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Rows x and z (0 and 2) of a point's Jacobian, and the point's acceleration while q's is 0. */
static void point(const double q[3], const double qd[3], double s, double t, double j[][3],
                  double bias[3]) {
    const double sa = s * sin(q[1]), ca = s * cos(q[1]), sb = t * sin(q[2]), cb = t * cos(q[2]);
    j[0][0] = 0, j[0][1] = -ca, j[0][2] = -cb;
    j[2][0] = 1, j[2][1] = sa, j[2][2] = sb;
    bias[0] = sa * qd[1] * qd[1] + sb * qd[2] * qd[2];
    bias[2] = ca * qd[1] * qd[1] + cb * qd[2] * qd[2];
}

/* M^-1 of M = sum of J^T m J; takes h = sum of J^T m (J_dot qd + g) from the forces. */
static void dynamics(const double q[3], const double qd[3], double inverse[3][3], double force[3]) {
    double m[3][3] = {{0}}, j[3][3], bias[3];
    for (int k = 0; k < 4; k++) {
        const double *link = masses[k], mass = link[2];
        point(q, qd, link[0], link[1], j, bias);
        for (int r = 0; r < 3; r++) {
            force[r] -= mass * (j[0][r] * bias[0] + j[2][r] * (bias[2] + gravity));
            for (int c = 0; c < 3; c++) {
                m[r][c] += mass * (j[0][r] * j[0][c] + j[2][r] * j[2][c]);
            }
        }
    }
    for (int r = 0; r < 3; r++) { /* cofactors, indices modulo 3 */
        const double *u = m[(r + 1) % 3], *v = m[(r + 2) % 3];
        for (int c = 0; c < 3; c++) {
            inverse[c][r] = u[(c + 1) % 3] * v[(c + 2) % 3] - u[(c + 2) % 3] * v[(c + 1) % 3];
        }
    }
    const double det = m[0][0] * inverse[0][0] + m[0][1] * inverse[1][0] + m[0][2] * inverse[2][0];
    for (int k = 0; k < 9; k++) {
        inverse[k / 3][k % 3] /= det;
    }
}

int main(void) {
    static const double outline[] = {-0.1, -0.04, 0.1,  -0.04,
                                     0.1,  0.04,  -0.1, 0.04}; /* [m] x, y of four corners */
    const MildSoleDef def = {.outline = outline, .points = 4, .pitch = 0.0195, .sole_z = -ankle};
    MildError error = {.text = "out of memory"};
    MildSole *sole = mild_sole_create(&def, &error);
    const MildSole *soles[] = {sole};
    MildScratch *scratch = sole ? mild_scratch_create(soles, 1, &error) : NULL;
    void *block = scratch ? aligned_alloc(64, mild_ground_bytes(soles, 1)) : NULL;
    if (!block) {
        return fprintf(stderr, "two_link: %s\n", error.text), 1;
    }
    MildGround *ground = mild_ground_init(block, soles, 1);
    MildMaterial foam = mild_material_default();
    mild_material_preset("foam45", &foam);
    const MildTerrain terrain = mild_terrain_uniform(&foam);
    double A[36] = {0}; /* J M^-1 J^T */
    MildContactInput in = {.feet = 1, .dt = dt, .inverse_inertia = A};
    MildContactResult out;
    double q[3] = {(thigh + shank) * cos(crouch) + ankle + 0.02, -crouch, crouch}, qd[3] = {0};
    printf("%7s %7s %8s %8s %9s\n", "time/s", "hip/m", "turn/rad", "up/N", "depth/mm");
    for (int step = 1; step <= 4000; step++) {
        const double bend =
            crouch +
            0.12 * sin(3.141593 * fmax(0, step * dt - 1)); /* squats at 0.5 Hz, from 1 s on */
        const double hip = 300 * (-bend - q[1]) - 10 * qd[1];
        const double knee = 300 * (2 * bend - (q[2] - q[1])) - 10 * (qd[2] - qd[1]);
        double force[3] = {0, hip - knee, knee};
        double inverse[3][3], bias[3], mj[6][3],
            j[6][3] = {[4] = {0, 0, 1}}; /* the foot turns with the shank */
        dynamics(q, qd, inverse, force);
        point(q, qd, thigh, shank, j, bias);
        for (int r = 0; r < 6; r++) {
            in.velocity[0][r] = dot(j[r], qd);
            for (int i = 0; i < 3; i++) {
                mj[r][i] = dot(inverse[i], j[r]); /* M^-1 J^T, transposed */
            }
        }
        for (int i = 0; i < 3; i++) {
            qd[i] += dt * dot(inverse[i], force); /* free motion */
        }
        for (int r = 0; r < 6; r++) {
            in.free_velocity[r] = dot(j[r], qd);
            for (int c = 0; c < 6; c++) {
                A[6 * r + c] = dot(j[r], mj[c]);
            }
        }
        const double turn = q[2] - crouch, c = cos(turn), s = sin(turn),
                     rotation[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
        for (int i = 0; i < 9; i++) {
            in.rotation[0][i] = rotation[i];
        }
        in.position[0][0] = -thigh * sin(q[1]) - shank * sin(q[2]);
        in.position[0][2] = q[0] - thigh * cos(q[1]) - shank * cos(q[2]);
        mild_ground_solve(ground, &terrain, &in, scratch, &out);
        mild_ground_advance(ground, &terrain, &in, scratch, &out);
        const MildFootResult foot = out.foot[0];
        for (int i = 0; i < 3; i++) { /* qd += dt M^-1 J^T (force, torque) */
            for (int r = 0; r < 3; r++) {
                qd[i] += dt * (mj[r][i] * foot.force[r] + mj[3 + r][i] * foot.torque[r]);
            }
            q[i] += dt * qd[i];
        }
        if (step % 250 == 0) {
            printf("%7.3f %7.4f %8.4f %8.2f %9.2f\n", step * dt, q[0], turn, foot.force[2],
                   1e3 * foot.depth_max);
        }
    }
    free(block);
    mild_scratch_destroy(scratch);
    mild_sole_destroy(sole);
    return 0;
}
