#include "cable.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "host.h"

#define PATIENCE_MS 200 /* for a host that answered before */

static void put(cable_way *way, uint64_t due, const uint8_t *bytes, size_t len) {
    if (way->end - way->first == PARCELS) return; /* lost, as in an adapter */
    unsigned at = way->end++ % PARCELS;
    way->parcel[at].due = due;
    way->parcel[at].len = len;
    memcpy(way->parcel[at].bytes, bytes, len);
}

void cable_open(cable *c, uint64_t held) {
    int kept; /* open for good, or a host that leaves would hang the line up */
    char name[128];
    c->held = held;
    if (openpty(&c->port, &kept, name, NULL, NULL) != 0) {
        perror("bench: no pseudo-terminal");
        exit(1);
    }
    struct termios raw;
    tcgetattr(kept, &raw);
    cfmakeraw(&raw);
    tcsetattr(kept, TCSANOW, &raw);
    fcntl(c->port, F_SETFL, O_NONBLOCK);
    printf("board on %s\n", name);
    fflush(stdout);
}

void cable_byte(cable *c, uint64_t now, uint8_t byte) {
    c->frame[c->len++] = byte;
    if (byte && c->len < sizeof c->frame) return;
    put(&c->to_host, now + c->held, c->frame, c->len);
    c->len = 0;
}

/* What the board sent. */
static void deliver(cable *c, uint64_t now) {
    for (; c->to_host.first != c->to_host.end; c->to_host.first++) {
        unsigned at = c->to_host.first % PARCELS;
        if (c->to_host.parcel[at].due > now) return;
        const uint8_t *bytes = c->to_host.parcel[at].bytes;
        size_t len = c->to_host.parcel[at].len;
        host_sample sample;
        if (host_reads(bytes, len, &sample)) {
            c->is_waiting = true;
            c->asked = sample.seq;
        }
        /* A host that does not read loses bytes, as on a cable. */
        if (write(c->port, bytes, len) < 0 && errno != EAGAIN) perror("bench: pseudo-terminal");
    }
}

static int64_t wall_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* What the host sent. The board's time stands still while the host thinks, if it answered the sample before. */
static void hear(cable *c, uint64_t now) {
    int64_t until = 0;
    for (;;) {
        struct pollfd host = {c->port, POLLIN, 0};
        bool owes = c->is_waiting && c->is_answering;
        if (owes && until == 0) until = wall_ms() + PATIENCE_MS;
        int64_t left = owes ? until - wall_ms() : 0;
        if (poll(&host, 1, left > 0 ? (int)left : 0) <= 0 || left < 0) {
            if (owes) c->is_answering = false;
            return;
        }
        uint8_t bytes[128];
        ssize_t n = read(c->port, bytes, sizeof bytes);
        if (n <= 0) return;
        put(&c->to_board, now + c->held, bytes, (size_t)n);
        for (ssize_t i = 0; i < n; i++) {
            furuta_received got;
            if (furuta_receive(&c->ear, bytes[i], &got) != FURUTA_COMMAND || got.seq != c->asked) continue;
            c->is_waiting = false;
            c->is_answering = true;
        }
    }
}

void cable_pass(cable *c, uint64_t now, void (*tell)(const uint8_t *bytes, unsigned len)) {
    deliver(c, now);
    hear(c, now);
    for (; c->to_board.first != c->to_board.end; c->to_board.first++) {
        unsigned at = c->to_board.first % PARCELS;
        if (c->to_board.parcel[at].due > now) return;
        tell(c->to_board.parcel[at].bytes, (unsigned)c->to_board.parcel[at].len);
    }
}
