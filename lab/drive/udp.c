#include "drive/udp.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <netdb.h>
#include <stdio.h>
#include <string.h>
#include <sys/select.h>
#include <unistd.h>

#include "base/text.h"

static MildStatus find_host(const char *option, const char *host, struct sockaddr_in *address,
                            MildError *error) {
    const struct addrinfo wanted = {.ai_family = AF_INET, .ai_socktype = SOCK_DGRAM};
    struct addrinfo *found;
    const int failed = getaddrinfo(host, NULL, &wanted, &found);
    if (failed) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--%s: %.100s: %s", option, host,
                         gai_strerror(failed));
    }
    memcpy(address, found->ai_addr, sizeof *address);
    freeaddrinfo(found);
    return MILD_OK;
}

/* HOST:PORT, or with an optional port, which is 0 then. */
static MildStatus find_address(const char *option, const char *text, int optional,
                               struct sockaddr_in *address, MildError *error) {
    char host[256];
    int port = 0;
    const char *colon = strrchr(text, ':');
    const size_t length = colon ? (size_t)(colon - text) : strlen(text);
    if ((!colon && !optional) || length == 0 || length >= sizeof host ||
        (colon && (!text_int(colon + 1, &port) || port < 0 || port > 65535))) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--%s: '%.100s' is not %s", option, text,
                         optional ? "HOST or HOST:PORT, as 192.168.1.10"
                                  : "HOST:PORT, as 127.0.0.1:9870");
    }
    memcpy(host, text, length);
    host[length] = '\0';
    MildStatus status = find_host(option, host, address, error);
    address->sin_port = htons((uint16_t)port);
    return status;
}

/* What the user can do about a failed bind, or "". */
static const char *remedy(int reason) {
    return reason == EADDRINUSE      ? "; end the program that has it, or name another port"
           : reason == EADDRNOTAVAIL ? "; name an address of this machine"
           : reason == EACCES        ? "; name a port from 1024"
                                     : "";
}

static MildStatus open_bound(Udp *udp, const char *option, const char *text, MildError *error) {
    socklen_t size = sizeof udp->own;
    udp->has_peer = 0;
    udp->file = socket(AF_INET, SOCK_DGRAM, 0);
    if (udp->file < 0 || udp->file >= FD_SETSIZE || fcntl(udp->file, F_SETFL, O_NONBLOCK) != 0 ||
        bind(udp->file, (const struct sockaddr *)&udp->own, sizeof udp->own) != 0 ||
        getsockname(udp->file, (struct sockaddr *)&udp->own, &size) != 0) {
        mild_fail(error, MILD_ERROR_IO, "--%s: %.100s: %s%s", option, text, strerror(errno),
                  remedy(errno));
        udp_close(udp);
        return MILD_ERROR_IO;
    }
    return MILD_OK;
}

MildStatus udp_listen(Udp *udp, const char *option, const char *address, MildError *error) {
    MildStatus status = find_address(option, address, 0, &udp->own, error);
    return status == MILD_OK ? open_bound(udp, option, address, error) : status;
}

MildStatus udp_connect(Udp *udp, const char *option, const char *address, const char *bind,
                       MildError *error) {
    struct sockaddr_in peer;
    MildStatus status = find_address(option, address, 0, &peer, error);
    if (status == MILD_OK) {
        status = find_address("bind", bind ? bind : "127.0.0.1", 1, &udp->own, error);
    }
    if (status == MILD_OK && !bind && ntohl(peer.sin_addr.s_addr) >> 24 != IN_LOOPBACKNET) {
        status = mild_fail(error, MILD_ERROR_ARGUMENT,
                           "--%s: %.100s is another machine; name an address of this one that it "
                           "can reach, --bind HOST[:PORT]",
                           option, address);
    }
    if (status == MILD_OK) {
        status = open_bound(udp, bind ? "bind" : option, bind ? bind : address, error);
    }
    udp->peer = peer;
    udp->has_peer = status == MILD_OK;
    return status;
}

MildStatus udp_find_sender(const char *option, const char *text, uint64_t *sender,
                           MildError *error) {
    struct sockaddr_in address;
    const MildStatus status = find_address(option, text, 1, &address, error);
    if (status == MILD_OK && address.sin_addr.s_addr == htonl(INADDR_ANY)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--%s: %.100s is no robot's address; leave the option out to hear any",
                         option, text);
    }
    *sender = status == MILD_OK ? udp_sender(&address) : 0;
    return status;
}

void udp_close(Udp *udp) {
    if (udp->file >= 0) {
        close(udp->file);
    }
    udp->file = -1;
}

const char *udp_text(const struct sockaddr_in *address, char text[32]) {
    char host[INET_ADDRSTRLEN] = "?";
    inet_ntop(AF_INET, &address->sin_addr, host, sizeof host);
    snprintf(text, 32, "%s:%d", host, ntohs(address->sin_port));
    return text;
}

void udp_wait(const Udp *udp, double seconds) {
    const double whole = floor(fmax(seconds, 0));
    const struct timespec most = {(time_t)whole, (long)(1e9 * (fmax(seconds, 0) - whole))};
    fd_set files;
    FD_ZERO(&files);
    FD_SET(udp->file, &files);
    pselect(udp->file + 1, &files, NULL, NULL, &most, NULL);
}

int udp_receive(const Udp *udp, uint8_t *bytes, size_t most, struct sockaddr_in *from) {
    socklen_t size = sizeof *from;
    const ssize_t got = recvfrom(udp->file, bytes, most, 0, (struct sockaddr *)from, &size);
    return got < 0 ? -1 : (int)got; /* -1 also for a peer's port that is closed */
}

uint64_t udp_sender(const struct sockaddr_in *address) {
    return (uint64_t)ntohl(address->sin_addr.s_addr) << 16 | ntohs(address->sin_port);
}

void udp_send(const Udp *udp, const uint8_t *bytes, size_t size) {
    if (udp->has_peer) {
        (void)sendto(udp->file, bytes, size, 0, (const struct sockaddr *)&udp->peer,
                     sizeof udp->peer);
    }
}
