/* A server of the files of one folder, for a browser (HTTP/1.1, GET and HEAD). */
#ifndef MILD_SERVE_H
#define MILD_SERVE_H

#include <stddef.h>

#include "mild/error.h"

enum { SERVE_NAME = 64, SERVE_REQUEST = 4096 };

/* The answer to a request. */
typedef struct {
    int status;            /* 200, or what is wrong with it: 400, 404, 405 */
    int head;              /* bool: without the file */
    char name[SERVE_NAME]; /* of the file: letters, digits, '_' and '-', one dot, a known ending */
    const char *type;      /* its media type */
} ServeAnswer;

/* Reads the first lines of a request. A name never has a slash, so that nothing outside of the
 * folder can be asked for. */
ServeAnswer serve_read(const char *request, size_t size);

/* Listens at an address, an IPv4 number. port: 0 takes a free one; *port is the one that it is.
 * Returns the socket, or -1. */
int serve_listen(const char *address, int *port, MildError *error);
/* Answers until the process ends, or until the socket fails. A request has some seconds, and so
 * many are answered at once; the others are answered 503, try again. */
MildStatus serve_folder(int listening, const char *folder, MildError *error);

#endif
