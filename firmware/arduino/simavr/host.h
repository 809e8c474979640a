/* What a host does with frames, as far as the bench needs it. */
#ifndef HOST_H
#define HOST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint32_t seq;
    uint64_t t_us;
    int32_t counts[2];
    uint8_t status;
} host_sample;

/* The sample in a frame of the board; false for a hello and for anything damaged. */
bool host_reads(const uint8_t *frame, size_t len, host_sample *sample);
/* The frame of a command; returns its length. */
size_t host_command(uint8_t *frame, uint32_t seq, float volts);

#endif
