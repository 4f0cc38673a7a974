/* Resistive force theory (plate.h) for plates on their own. */
#include "ground/plate.h"
#include "mild/ground.h"

void mild_resist_plane(double beta, double gamma, double alpha[2]) {
    const Alpha plane = plane_alpha(cos(2.0 * beta), sin(2.0 * beta), cos(gamma), sin(gamma));
    alpha[0] = plane.x;
    alpha[1] = plane.z;
}

void mild_resist_space(const double normal[3], const double direction[3], double alpha[3]) {
    double x = -direction[2];
    double z = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2];
    double f[3];
    for (int k = 0; k < 3; k++) {
        Cubic a;
        cubic_at(space_coefficients(k), -normal[2], a);
        f[k] = cubic(a, x, z);
    }
    double scale = z < 0.0 ? 0.0 : 1.0 / RESIST_LEVEL; /* no force on a trailing face */
    for (int k = 0; k < 3; k++) {
        alpha[k] = scale * (f[0] * normal[k] + f[1] * direction[k] - (k == 2 ? f[2] : 0.0));
    }
}
