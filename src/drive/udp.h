/* A UDP socket with one peer (IPv4). */
#ifndef DRIVE_UDP_H
#define DRIVE_UDP_H

#include <netinet/in.h>
#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"

typedef struct {
    int file;                /* descriptor */
    int has_peer;            /* bool */
    struct sockaddr_in own;  /* the address that it is bound to */
    struct sockaddr_in peer; /* where packets go */
} Udp;

/* address: HOST:PORT. Bound to it, without a peer; port 0: a free one. `option` names it in
 * messages. */
MildStatus udp_listen(Udp *udp, const char *option, const char *address, MildError *error);
/* Bound to any free port; its peer is this address. */
MildStatus udp_connect(Udp *udp, const char *option, const char *address, MildError *error);
void udp_close(Udp *udp);
/* "127.0.0.1:9870"; returns `text`. */
const char *udp_text(const struct sockaddr_in *address, char text[32]);

/* Waits for a packet, at most so long [s]. Returns at once when a signal comes. */
void udp_wait(const Udp *udp, double seconds);
/* A packet that has come, cut to `most` bytes, and who sent it. Returns its size, or -1: there is
 * none. */
int udp_receive(const Udp *udp, uint8_t *bytes, size_t most, struct sockaddr_in *from);
int udp_same(const struct sockaddr_in *a, const struct sockaddr_in *b); /* bool */
/* To the peer, if there is one. A packet that cannot be sent is lost, as others are on their
 * way. */
void udp_send(const Udp *udp, const uint8_t *bytes, size_t size);

#endif
