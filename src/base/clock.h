/* Monotonic wall clock [s]. */
#ifndef MILD_CLOCK_H
#define MILD_CLOCK_H
double clock_seconds(void);
#endif
