/* Time [s]. */
#ifndef MILD_CLOCK_H
#define MILD_CLOCK_H
/* Monotonic wall clock. */
double clock_seconds(void);
/* This thread's processor time: the slices that other programs take do not count. Reading it is a
 * system call. */
double clock_thread_seconds(void);
#endif
