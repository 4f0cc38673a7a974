/* One error type for every layer: a status and one clear line. Libraries never print, exit or abort. */
#ifndef MILD_ERROR_H
#define MILD_ERROR_H

#include "mild/api.h"

MILD_API_BEGIN

typedef enum {
    MILD_OK = 0,
    MILD_ERROR_ARGUMENT, /* a value the caller gave is not usable */
    MILD_ERROR_RANGE,    /* a number is outside its documented range */
    MILD_ERROR_FORMAT,   /* a file is not what its name says */
    MILD_ERROR_IO,       /* reading or writing failed */
    MILD_ERROR_MEMORY,   /* allocation failed */
} MildStatus;

typedef struct {
    MildStatus status;
    char text[400]; /* one line, no newline: what, where, remedy */
} MildError;

/* Fill *error (may be NULL) printf-style; returns status so that `return mild_fail(...)` reads well. Thread safe. */
MildStatus mild_fail(MildError *error, MildStatus status, const char *format, ...);

MILD_API_END

#endif
