/* Student's t distribution: half widths of confidence intervals. */
#ifndef BASE_STUDENT_H
#define BASE_STUDENT_H

/* The t for which a Student variable with `freedom` degrees of freedom lies within -t .. t with
 * probability 0.95: 12.706 for 1, 1.960 for infinitely many. Exact to rounding. NaN for freedom
 * below 1. Pure function: thread safe. */
double student_95(int freedom);

#endif
