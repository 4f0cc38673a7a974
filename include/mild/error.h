/* Errors: a status and one line of text. The library never prints, exits or aborts. Thread safety:
 * a MildError belongs to its caller; nothing is shared. */
#ifndef MILD_ERROR_H
#define MILD_ERROR_H

#include "mild/api.h"

MILD_API_BEGIN

/* Result of a function that can fail. A function that returns a pointer returns NULL instead and
 * writes the status to *error. */
typedef enum {
    MILD_OK = 0,         /* success */
    MILD_ERROR_ARGUMENT, /* an argument is invalid */
    MILD_ERROR_RANGE,    /* a number is outside its documented range */
    MILD_ERROR_FORMAT,   /* a file has the wrong format */
    MILD_ERROR_IO,       /* reading or writing failed */
    MILD_ERROR_MEMORY,   /* allocation failed */
} MildStatus;

/* Every `MildError *error` may be NULL. It is written only on failure, so initialise it with
 * {0}. */
typedef struct {
    MildStatus status; /* MILD_OK until something fails */
    char text[400];    /* one line without a newline: what is wrong, where, and the remedy */
} MildError;

/* Formats *error (may be NULL) like printf. Returns `status`, so that a function can end with
 * `return mild_fail(...)`. */
MildStatus mild_fail(MildError *error, MildStatus status, const char *format, ...)
    MILD_PRINTF(3, 4);

MILD_API_END

#endif
