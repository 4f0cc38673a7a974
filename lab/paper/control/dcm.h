/* The divergent component of motion (DCM) xi = x + b v of the centre of mass x with velocity v, and
 * its plan. With b = sqrt(height / g) and the virtual repellent point p, which lies `height` above
 * the point that the ground's force on the centre of mass comes from (Englsberger, Ott and
 * Albu-Schaeffer 2015),
 *
 *     b^2 a = x - p,    b v = xi - x,    b xi' = xi - p.
 *
 * xi runs away from p, so a plan is found backwards in time: where p goes is given by the feet, and
 * xi must come to rest where p does. */
#ifndef CONTROL_DCM_H
#define CONTROL_DCM_H

/* p(t) = from + (to - from) t / duration + sway cos(angle + rate t) */
typedef struct {
    double from[3];  /* [m] */
    double to[3];    /* [m] */
    double duration; /* [s] 0: nothing */
    double sway[3];  /* [m] */
    double angle;    /* [rad] */
    double rate;     /* [rad/s] */
} DcmSegment;

/* [m] p at the start of a segment. */
void dcm_point(const DcmSegment *segment, double point[3]);
/* xi [m] at the start of the first of `count` segments, for which it is at rest at the end of the
 * last one. b: [s]. */
void dcm_plan(const DcmSegment *segments, int count, double b, double xi[3]);

#endif
