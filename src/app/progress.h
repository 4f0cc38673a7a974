/* The progress of long work, and Ctrl-C. On a terminal one line is rewritten; elsewhere a line
 * comes every ten seconds. */
#ifndef MILD_PROGRESS_H
#define MILD_PROGRESS_H

typedef struct {
    const char *what;    /* "training" */
    double start, shown; /* [s] clock */
    int terminal;        /* bool */
    int width;           /* characters of the line on the terminal, to be overwritten */
} Progress;

Progress progress_begin(const char *what);

/* share: how much is done, 0 .. 1, for the time left; negative when the end is not known. The
 * numbers that matter come printf-style. Cheap when called often: a terminal is written ten times a
 * second at most. */
void progress_show(Progress *progress, double share, const char *format, ...);

/* Shows the last state however recent the line before it was, and ends the line. */
void progress_end(Progress *progress, const char *format, ...);

/* From now on the first Ctrl-C (or SIGTERM, or SIGHUP from a terminal that closes) only sets the
 * flag; a second Ctrl-C or SIGTERM ends the program at once. Call it before any other thread is made. */
void interrupt_install(void);
int interrupt_requested(void);

#endif
