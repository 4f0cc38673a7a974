/* Time [s]. */
#ifndef MILD_CLOCK_H
#define MILD_CLOCK_H
/* Monotonic wall clock. */
double clock_seconds(void);
/* Processor time of this thread, which excludes time taken by other programs. Costs a system
 * call. */
double clock_thread_seconds(void);
#endif
