/* Resistive force theory (plate.h) for a plate on its own. */
#include "ground/law/plate.h"
#include "mild/ground.h"

void mild_resist_plane(double beta, double gamma, double alpha[2]) {
    const Alpha plane = plane_alpha(cos(2.0 * beta), sin(2.0 * beta), cos(gamma), sin(gamma));
    alpha[0] = plane.x;
    alpha[1] = plane.z;
}
