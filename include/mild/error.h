/* One error type for every layer: a status and one clear line. Libraries never print, exit or
 * abort. Thread safety: a MildError belongs to its caller; nothing is shared. */
#ifndef MILD_ERROR_H
#define MILD_ERROR_H

#include "mild/api.h"

MILD_API_BEGIN

/* What a function that can fail returns: 0 on success. A function that returns a pointer returns
 * NULL instead and leaves the status in its *error. */
typedef enum {
    MILD_OK = 0,         /* done */
    MILD_ERROR_ARGUMENT, /* a value the caller gave is not usable */
    MILD_ERROR_RANGE,    /* a number is outside its documented range */
    MILD_ERROR_FORMAT,   /* a file is not what its name says */
    MILD_ERROR_IO,       /* reading or writing failed */
    MILD_ERROR_MEMORY,   /* allocation failed */
} MildStatus;

/* Every `MildError *error` may be NULL. It is written on failure only: one that starts as {0} tells
 * afterwards. */
typedef struct {
    MildStatus status; /* MILD_OK until something fails */
    char text[400];    /* one line, no newline: what, where, remedy */
} MildError;

/* Fill *error (may be NULL) printf-style; returns status so that `return mild_fail(...)` reads
 * well. Thread safe. */
MildStatus mild_fail(MildError *error, MildStatus status, const char *format, ...);

MILD_API_END

#endif
