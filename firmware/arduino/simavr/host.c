#include "host.h"

#pragma GCC diagnostic ignored "-Wunused-function"
#include "../furuta_rig/furuta_wire.h"

static uint64_t varint(const uint8_t *body, size_t len, size_t *at) {
    uint64_t n = 0;
    for (int shift = 0; *at < len && shift < 64; shift += 7) {
        n |= (uint64_t)(body[*at] & 127) << shift;
        if (body[(*at)++] < 128) break;
    }
    return n;
}

static int32_t zigzag(uint64_t n) { return (int32_t)(n >> 1) ^ -(int32_t)(n & 1); }

bool host_reads(const uint8_t *frame, size_t len, host_sample *sample) {
    uint8_t body[FURUTA_MAX_FRAME];
    size_t in = 0, out = 0;
    if (len < 7 || len > FURUTA_MAX_FRAME || frame[--len] != 0) return false;
    while (in < len) {
        size_t block = frame[in++];
        if (block == 0 || block - 1 > len - in) return false;
        for (size_t i = 1; i < block; i++) body[out++] = frame[in++];
        if (in < len) body[out++] = 0;
    }
    if (out < 5 || body[0] != 2) return false;
    uint32_t crc = furuta_crc32(body, out -= 4);
    for (int i = 0; i < 4; i++)
        if (body[out + i] != (uint8_t)(crc >> (8 * i))) return false;
    size_t at = 1;
    sample->seq = (uint32_t)varint(body, out, &at);
    sample->t_us = varint(body, out, &at);
    for (int axis = 0; axis < 2; axis++) sample->counts[axis] = zigzag(varint(body, out, &at));
    sample->status = body[out - 1];
    return at + 5 == out;
}

size_t host_command(uint8_t *frame, uint32_t seq, float volts) {
    furuta_packet p = {{0}, 0};
    furuta_put(&p, 3);
    furuta_put_varint(&p, seq);
    furuta_put_f32(&p, volts);
    return furuta_frame(&p, frame);
}
