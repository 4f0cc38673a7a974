/* A histogram of durations from 1 us to 100 s. */
#ifndef DRIVE_TIMES_H
#define DRIVE_TIMES_H

enum { TIMES_DECADE = 24, TIMES_BINS = 8 * TIMES_DECADE }; /* each bin 10 % wide */

typedef struct {
    long count, bin[TIMES_BINS];
    double longest; /* [s] */
} Times;

void times_add(Times *times, double seconds);
/* [s] Upper end of the bin where this share of the durations is reached, at most the longest; 0
 * when there are none. */
double times_quantile(const Times *times, double share);
/* [s] Lower end of a bin; index TIMES_BINS: upper end of the last. */
double times_edge(int bin);

#endif
