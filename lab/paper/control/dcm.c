#include "paper/control/dcm.h"

#include <math.h>
#include <string.h>

void dcm_point(const DcmSegment *segment, double point[3]) {
    for (int k = 0; k < 3; k++) {
        point[k] = segment->from[k] + segment->sway[k] * cos(segment->angle);
    }
}

/* The solution of b xi' = xi - p that does not run away, less the straight part of p: with the
 * velocity w of that part
 *
 *     b w + sway (cos(angle) - b rate sin(angle)) / (1 + (b rate)^2). */
static double bounded_part(const DcmSegment *segment, int k, double angle, double b) {
    const double straight = b * (segment->to[k] - segment->from[k]) / segment->duration;
    const double turn = b * segment->rate;
    return straight + segment->sway[k] * (cos(angle) - turn * sin(angle)) / (1 + turn * turn);
}

/* Every other solution differs from the bounded one by a multiple of exp(t / b). */
void dcm_plan(const DcmSegment *segments, int count, double b, double xi[3]) {
    memcpy(xi, segments[count - 1].to, 3 * sizeof *xi);
    for (int s = count - 1; s >= 0; s--) {
        const DcmSegment *segment = &segments[s];
        if (segment->duration <= 0) {
            continue;
        }
        const double decay = exp(-segment->duration / b);
        const double last = segment->angle + segment->rate * segment->duration;
        for (int k = 0; k < 3; k++) {
            const double end = segment->to[k] + bounded_part(segment, k, last, b);
            const double start = segment->from[k] + bounded_part(segment, k, segment->angle, b);
            xi[k] = start + (xi[k] - end) * decay;
        }
    }
}
