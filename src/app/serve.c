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
#include <unistd.h>

#include "base/clock.h"

#define REQUEST_TIME 5  /* [s] for a whole request, however slowly its bytes come */
#define ANSWER_TIME 120 /* [s] for a whole answer: some MB through a poor network */
#define CLIENTS 64      /* at once; browsers open a few ahead of need */
#define STACK (256 << 10)
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

/* Waits until the socket is ready. Returns 0 when the time is over. */
static int wait_for(int socket, short event, double deadline) {
    for (;;) {
        struct pollfd poll_for = {.fd = socket, .events = event};
        const double left = deadline - clock_seconds();
        const int ready = left > 0 ? poll(&poll_for, 1, (int)(1000 * left) + 1) : 0;
        if (ready >= 0 || errno != EINTR) {
            return ready > 0;
        }
    }
}

static int send_all(int socket, const char *bytes, size_t count, double deadline) {
    while (count > 0) {
        if (!wait_for(socket, POLLOUT, deadline)) {
            return 0;
        }
        const ssize_t sent = send(socket, bytes, count, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent <= 0 && errno != EAGAIN && errno != EINTR) {
            return 0;
        }
        bytes += sent > 0 ? sent : 0;
        count -= sent > 0 ? (size_t)sent : 0;
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

/* Up to the empty line; what follows it is not wanted. Returns the bytes. *late: they were not all
 * there in time. */
static size_t receive(int socket, char *request, int *late) {
    const double deadline = clock_seconds() + REQUEST_TIME;
    size_t size = 0;
    *late = 0;
    while (size < SERVE_REQUEST && !is_whole(request, size)) {
        *late = !wait_for(socket, POLLIN, deadline);
        const ssize_t got =
            *late ? 0 : recv(socket, request + size, SERVE_REQUEST - size, MSG_DONTWAIT);
        if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) {
            break;
        }
        size += got > 0 ? (size_t)got : 0;
    }
    return size;
}

static const char *status_text(int status) {
    switch (status) {
    case 200: return "OK";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed";
    case 408: return "Request Timeout";
    case 503: return "Service Unavailable";
    default: return "Bad Request";
    }
}

static void send_head(int socket, const ServeAnswer *answer, long long bytes, double deadline) {
    char head[320];
    const int length = snprintf(head, sizeof head,
                                "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %lld\r\n"
                                "Cache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\n"
                                "%sConnection: close\r\n\r\n",
                                answer->status, status_text(answer->status),
                                answer->type ? answer->type : "text/plain", bytes,
                                answer->status == 503 ? "Retry-After: 5\r\n" : "");
    send_all(socket, head, (size_t)length, deadline);
}

static void send_file(int socket, int file, double deadline) {
    char block[16384];
    for (ssize_t got = 1; got > 0;) {
        got = read(file, block, sizeof block);
        if (got > 0 && !send_all(socket, block, (size_t)got, deadline)) {
            return;
        }
    }
}

static void answer_client(const Client *client) {
    char request[SERVE_REQUEST];
    struct stat about = {0};
    int late;
    const size_t size = receive(client->socket, request, &late);
    const double deadline = clock_seconds() + ANSWER_TIME;
    ServeAnswer answer = serve_read(request, size);
    if (late) {
        answer = (ServeAnswer){.status = 408};
    }
    const int file = answer.status == 200 ? openat(client->folder, answer.name,
                                                   O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)
                                          : -1;
    const int found = file >= 0 && fstat(file, &about) == 0 && S_ISREG(about.st_mode);
    if (answer.status == 200 && !found) {
        answer.status = 404;
        answer.type = NULL;
    }
    send_head(client->socket, &answer, found ? (long long)about.st_size : 0, deadline);
    if (found && !answer.head) {
        send_file(client->socket, file, deadline);
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

/* Says so at once, without a thread, and reads what has come: closing with unread bytes would lose
 * the answer on its way. */
static void refuse_client(int socket) {
    const ServeAnswer busy = {.status = 503};
    char unread[SERVE_REQUEST];
    send_head(socket, &busy, 0, clock_seconds() + 0.01);
    shutdown(socket, SHUT_WR);
    (void)!recv(socket, unread, sizeof unread, MSG_DONTWAIT);
    close(socket);
}

static int start_thread(Client *client) {
    pthread_attr_t attributes;
    pthread_t thread;
    if (pthread_attr_init(&attributes) != 0) {
        return 0;
    }
    pthread_attr_setstacksize(&attributes, STACK);
    pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
    const int started = pthread_create(&thread, &attributes, run_client, client) == 0;
    pthread_attr_destroy(&attributes);
    return started;
}

static void take_client(int socket, int folder, atomic_int *clients) {
    Client *client = malloc(sizeof *client);
    const int many = atomic_fetch_add(clients, 1) >= CLIENTS;
    if (client) {
        *client = (Client){socket, folder, clients};
    }
    if (many || !client || !start_thread(client)) {
        atomic_fetch_sub(clients, 1);
        free(client);
        refuse_client(socket);
    }
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
