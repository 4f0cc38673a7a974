/* Progress of a long run, and Ctrl-C. On a terminal one line is updated in place; otherwise a line
 * is printed every ten seconds. */
#ifndef MILD_PROGRESS_H
#define MILD_PROGRESS_H

typedef struct {
    const char *what;    /* "training" */
    double start, shown; /* [s] clock */
    int terminal;        /* bool */
    int width;           /* characters of the line on the terminal */
} Progress;

Progress progress_begin(const char *what);

/* share: the part that is done, 0 .. 1, from which the time left follows; negative when the end is
 * unknown. The rest of the line is given as for printf. May be called often: a terminal is written
 * at most ten times a second. */
void progress_show(Progress *progress, double share, const char *format, ...);

/* Shows the last state in any case, and ends the line. */
void progress_end(Progress *progress, const char *format, ...);

/* From now on the first Ctrl-C (or SIGTERM, or SIGUSR1, which mpirun passes on, or SIGHUP from a
 * terminal that closes) only sets a flag. A second Ctrl-C or SIGTERM ends the program at once. Call
 * it before any other thread starts. */
void interrupt_install(void);
int interrupt_requested(void);

#endif
