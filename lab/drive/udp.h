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
/* The peer is `address`. Bound to --bind HOST[:PORT]; NULL: to a free port of this machine alone,
 * which fails when the peer is another. */
MildStatus udp_connect(Udp *udp, const char *option, const char *address, const char *bind,
                       MildError *error);
/* HOST[:PORT] as a sender; port 0: any. Fails for an address that nobody can send from. */
MildStatus udp_find_sender(const char *option, const char *text, uint64_t *sender,
                           MildError *error);
void udp_close(Udp *udp);
/* "127.0.0.1:9870"; returns `text`. */
const char *udp_text(const struct sockaddr_in *address, char text[32]);

/* Waits for a packet, at most so long [s]. Returns at once when a signal comes. */
void udp_wait(const Udp *udp, double seconds);
/* A packet that has come, cut to `most` bytes, and who sent it. Returns its size, or -1: there is
 * none. */
int udp_receive(const Udp *udp, uint8_t *bytes, size_t most, struct sockaddr_in *from);
/* Address, then 16 bits of port: the same for the same sender, never 0. */
uint64_t udp_sender(const struct sockaddr_in *address);
/* To the peer, if there is one. A packet that cannot be sent is lost, as others are on their
 * way. */
void udp_send(const Udp *udp, const uint8_t *bytes, size_t size);

#endif
