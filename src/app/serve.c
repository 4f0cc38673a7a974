#include "app/serve.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#define PATIENCE 10 /* [s] for a client that says or takes nothing */
#define CLIENTS 64  /* at once; browsers open a few ahead of need */
#define LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-"

/* ---- requests ---- */

static const char *type_of(const char *ending) {
    static const char *const types[][2] = {
        {"html", "text/html; charset=utf-8"},
        {"css", "text/css; charset=utf-8"},
        {"js", "text/javascript"},
        {"wasm", "application/wasm"},
        {"bin", "application/octet-stream"},
        {"png", "image/png"},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (strcmp(ending, types[i][0]) == 0) {
            return types[i][1];
        }
    }
    return NULL;
}

/* path: of the request, behind its first slash. */
static void find_file(const char *path, size_t length, ServeAnswer *answer) {
    answer->status = 404;
    if (length == 0) {
        path = "index.html";
        length = strlen(path);
    }
    if (length >= sizeof answer->name) {
        return;
    }
    memcpy(answer->name, path, length);
    answer->name[length] = '\0';
    const size_t stem = strspn(answer->name, LETTERS);
    const char *dot = answer->name + stem;
    if (stem > 0 && strlen(answer->name) == length && *dot == '.') {
        answer->type = type_of(dot + 1);
    }
    answer->status = answer->type ? 200 : 404;
}

ServeAnswer serve_read(const char *request, size_t size) {
    ServeAnswer answer = {.status = 400};
    const char *line = memchr(request, '\n', size);
    const size_t length = line ? (size_t)(line - request) : 0;
    const char *space = length ? memchr(request, ' ', length) : NULL;
    const char *path = space ? space + 1 : NULL;
    const char *end = path ? memchr(path, ' ', length - (size_t)(path - request)) : NULL;
    if (!end || *path != '/' || length - (size_t)(end - request) < 9 ||
        memcmp(end, " HTTP/1.", 8) != 0) {
        return answer;
    }
    const size_t method = (size_t)(space - request);
    answer.head = method == 4 && memcmp(request, "HEAD", 4) == 0;
    if (!answer.head && !(method == 3 && memcmp(request, "GET", 3) == 0)) {
        answer.status = 405;
        return answer;
    }
    const char *query = memchr(path, '?', (size_t)(end - path));
    find_file(path + 1, (size_t)((query ? query : end) - path) - 1, &answer);
    return answer;
}

/* ---- clients ---- */

typedef struct {
    int socket;
    int folder;
    atomic_int *clients;
} Client;

static int send_all(int socket, const char *bytes, size_t count) {
    while (count > 0) {
        const ssize_t sent = send(socket, bytes, count, MSG_NOSIGNAL);
        if (sent <= 0) {
            return 0;
        }
        bytes += sent;
        count -= (size_t)sent;
    }
    return 1;
}

/* Bool: the empty line is there. */
static int is_whole(const char *request, size_t size) {
    for (size_t i = 1; i < size; i++) {
        const int before =
            request[i - 1] == '\n' || (i > 1 && request[i - 1] == '\r' && request[i - 2] == '\n');
        if (request[i] == '\n' && before) {
            return 1;
        }
    }
    return 0;
}

/* Up to the empty line; what follows it is not wanted. Returns the bytes. */
static size_t receive(int socket, char *request) {
    size_t size = 0;
    while (size < SERVE_REQUEST && !is_whole(request, size)) {
        const ssize_t got = recv(socket, request + size, SERVE_REQUEST - size, 0);
        if (got <= 0) {
            break;
        }
        size += (size_t)got;
    }
    return size;
}

static void send_head(int socket, const ServeAnswer *answer, long long bytes) {
    char head[320];
    const char *say = answer->status == 200   ? "OK"
                      : answer->status == 404 ? "Not Found"
                      : answer->status == 405 ? "Method Not Allowed"
                                              : "Bad Request";
    const int length =
        snprintf(head, sizeof head,
                 "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %lld\r\n"
                 "Cache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\n"
                 "Connection: close\r\n\r\n",
                 answer->status, say, answer->type ? answer->type : "text/plain", bytes);
    send_all(socket, head, (size_t)length);
}

static void send_file(int socket, int file) {
    char block[16384];
    for (ssize_t got = 1; got > 0;) {
        got = read(file, block, sizeof block);
        if (got > 0 && !send_all(socket, block, (size_t)got)) {
            return;
        }
    }
}

static void answer_client(const Client *client) {
    char request[SERVE_REQUEST];
    struct stat about = {0};
    ServeAnswer answer = serve_read(request, receive(client->socket, request));
    const int file = answer.status == 200 ? openat(client->folder, answer.name,
                                                   O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)
                                          : -1;
    const int found = file >= 0 && fstat(file, &about) == 0 && S_ISREG(about.st_mode);
    if (answer.status == 200 && !found) {
        answer.status = 404;
        answer.type = NULL;
    }
    send_head(client->socket, &answer, found ? (long long)about.st_size : 0);
    if (found && !answer.head) {
        send_file(client->socket, file);
    }
    if (file >= 0) {
        close(file);
    }
}

static void *run_client(void *context) {
    Client *client = context;
    answer_client(client);
    shutdown(client->socket, SHUT_RDWR);
    close(client->socket);
    atomic_fetch_sub(client->clients, 1);
    free(client);
    return NULL;
}

static void take_client(int socket, int folder, atomic_int *clients) {
    const struct timeval patience = {.tv_sec = PATIENCE};
    pthread_t thread;
    Client *client = malloc(sizeof *client);
    const int many = atomic_fetch_add(clients, 1) >= CLIENTS;
    setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (client) {
        *client = (Client){socket, folder, clients};
    }
    if (many || !client || pthread_create(&thread, NULL, run_client, client) != 0) {
        atomic_fetch_sub(clients, 1);
        free(client);
        close(socket);
        return;
    }
    pthread_detach(thread);
}

/* ---- the server ---- */

int serve_listen(const char *address, int *port, MildError *error) {
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)*port)};
    socklen_t size = sizeof at;
    const int yes = 1;
    if (inet_pton(AF_INET, address, &at.sin_addr) != 1) {
        mild_fail(error, MILD_ERROR_ARGUMENT, "--address %.60s: not a number such as 127.0.0.1",
                  address);
        return -1;
    }
    const int listening = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (listening >= 0 && setsockopt(listening, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
        bind(listening, (const struct sockaddr *)&at, sizeof at) == 0 &&
        listen(listening, CLIENTS) == 0 &&
        getsockname(listening, (struct sockaddr *)&at, &size) == 0) {
        *port = ntohs(at.sin_port);
        return listening;
    }
    const char *remedy = errno == EADDRNOTAVAIL ? "name an --address of this machine"
                                                : "try --port 0, which takes a free one";
    mild_fail(error, MILD_ERROR_IO, "%.60s, port %d: %s; %s", address, *port, strerror(errno),
              remedy);
    if (listening >= 0) {
        close(listening);
    }
    return -1;
}

MildStatus serve_folder(int listening, const char *folder, MildError *error) {
    static atomic_int clients; /* outlives the threads */
    const int at = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (at < 0) {
        return mild_fail(error, MILD_ERROR_IO, "%.200s: %s", folder, strerror(errno));
    }
    for (;;) {
        const int socket = accept(listening, NULL, NULL);
        if (socket >= 0) {
            take_client(socket, at, &clients);
        } else if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS) {
            poll(NULL, 0, 100); /* until others have ended */
        } else if (errno == EBADF || errno == EINVAL || errno == ENOTSOCK) {
            close(at);
            return mild_fail(error, MILD_ERROR_IO, "the socket failed: %s", strerror(errno));
        }
    }
}
