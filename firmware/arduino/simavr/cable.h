/* The host's side of the line: a pseudo-terminal, behind a USB adapter that holds what passes for a while. */
#ifndef CABLE_H
#define CABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../furuta_rig/furuta_wire.h"

#define PARCELS 64

/* Bytes on their way. */
typedef struct {
    struct {
        uint64_t due;
        size_t len;
        uint8_t bytes[128];
    } parcel[PARCELS];
    unsigned first, end;
} cable_way;

typedef struct {
    int port;
    uint64_t held; /* cycles, each way */
    cable_way to_host, to_board;
    uint8_t frame[128]; /* of the board, until its end */
    size_t len;
    /* Whether the host owes an answer. */
    uint32_t asked;    /* number of the newest sample that it got */
    bool is_waiting;   /* it is not answered yet */
    bool is_answering; /* the one before was */
    furuta_receiver ear;
} cable;

/* Opens the pseudo-terminal and prints its name. */
void cable_open(cable *c, uint64_t held);
/* A byte of the board, at this cycle. */
void cable_byte(cable *c, uint64_t now, uint8_t byte);
/* Hands over what is due; waits for a host that owes an answer. */
void cable_pass(cable *c, uint64_t now, void (*tell)(const uint8_t *bytes, unsigned len));

#endif
