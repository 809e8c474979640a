/* The rig's end of the furuta wire, protocol version 1 (docs/protocol.md), for a board programmed in C or Arduino C++.
 *
 * No library, no allocation, no I/O: the functions make frames into your buffer and take received bytes one at a time.
 * `crates/furuta-wire/tests/c_rig.rs` compiles this file and holds it against the Rust implementation. It assumes
 * nothing of the compiler but 8-bit bytes and IEEE 754 single precision `float` (AVR, ARM, ESP32, RISC-V, x86); AVR's
 * 4-byte `double` and either byte order are fine.
 *
 *     furuta_receiver in = {0};
 *     uint32_t seq = 0, obeyed = FURUTA_NONE_OBEYED;
 *     uint8_t frame[FURUTA_MAX_FRAME];
 *     ...
 *     while (Serial.available()) {
 *         furuta_received got;
 *         switch (furuta_receive(&in, Serial.read(), &got)) {
 *         case FURUTA_QUERY:   Serial.write(frame, furuta_hello(frame, "my-rig", 2000, 2048, 2048, 10.0f, limits, 10)); break;
 *         case FURUTA_COMMAND:
 *             if (isfinite(got.volts) && furuta_is_news(got.seq, seq, &obeyed, 10)) { newest = got.volts; fresh = true; }
 *             else if (got.volts == 0) newest = 0;   // off is always allowed, and feeds no watchdog
 *             else refused = true;
 *             break;
 *         default: break;   // FURUTA_NOTHING: no whole frame yet; FURUTA_BAD: bytes were lost or altered, ignore them
 *         }
 *     }
 *     // and at every tick of the period: latch, read the encoders, then
 *     Serial.write(frame, furuta_sample(frame, seq++, t_us, theta, alpha, held, status));
 */
#ifndef FURUTA_WIRE_H
#define FURUTA_WIRE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define FURUTA_VERSION 1
#define FURUTA_MAX_FRAME 87
#define FURUTA_NAME_CAPACITY 32

/* Flags of a sample. */
#define FURUTA_HELD 1      /* no valid command since the previous tick: the last one is held */
#define FURUTA_WATCHDOG 2  /* no valid command for the watchdog's periods, or none ever: the motor is off */
#define FURUTA_CLIPPED 4   /* the command was beyond the command limit and was clipped */
#define FURUTA_LIMIT 8     /* an angle or a speed is beyond its limit: the motor is off */
#define FURUTA_REFUSED 16  /* a command was refused: no finite number, or no news (furuta_is_news) */

/* ---- sending ---- */

typedef struct {
    uint8_t bytes[FURUTA_MAX_FRAME];
    uint8_t len;
} furuta_packet;

static void furuta_put(furuta_packet *p, uint8_t byte) { p->bytes[p->len++] = byte; }

static void furuta_put_varint(furuta_packet *p, uint64_t n) {
    for (; n >= 128; n >>= 7) furuta_put(p, (uint8_t)(n & 127) | 128);
    furuta_put(p, (uint8_t)n);
}

static void furuta_put_signed(furuta_packet *p, int32_t n) {
    furuta_put_varint(p, n < 0 ? ~((uint32_t)n << 1) : (uint32_t)n << 1);
}

static void furuta_put_f32(furuta_packet *p, float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    for (int i = 0; i < 4; i++) furuta_put(p, (uint8_t)(bits >> (8 * i)));
}

/* A whole number as IEEE 754 double precision, by hand: an AVR's `double` has 4 bytes. */
static void furuta_put_f64(furuta_packet *p, int32_t n) {
    uint64_t bits = 0;
    if (n != 0) {
        uint64_t size = n < 0 ? 0u - (uint32_t)n : (uint32_t)n;
        int exponent = 0;
        while (size >> (exponent + 1)) exponent++;
        bits = (size << (52 - exponent)) & 0xfffffffffffffULL;
        bits |= (uint64_t)(1023 + exponent) << 52;
        if (n < 0) bits |= 1ULL << 63;
    }
    for (int i = 0; i < 8; i++) furuta_put(p, (uint8_t)(bits >> (8 * i)));
}

/* Four bits at a time: a table of 64 bytes, a third of the time of bit by bit. */
static uint32_t furuta_crc32(const uint8_t *bytes, size_t len) {
    static const uint32_t of_nibble[16] = {
        0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
        0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    uint32_t crc = 0xffffffff;
    while (len--) {
        crc ^= *bytes++;
        crc = crc >> 4 ^ of_nibble[crc & 15];
        crc = crc >> 4 ^ of_nibble[crc & 15];
    }
    return ~crc;
}

/* Adds the CRC, codes by COBS, ends with the zero; returns the frame's length. */
static size_t furuta_frame(furuta_packet *p, uint8_t *frame) {
    uint32_t crc = furuta_crc32(p->bytes, p->len);
    for (int i = 0; i < 4; i++) furuta_put(p, (uint8_t)(crc >> (8 * i)));
    size_t code = 0, end = 1;
    for (size_t i = 0; i < p->len; i++) {
        if (p->bytes[i]) {
            frame[end++] = p->bytes[i];
        } else {
            frame[code] = (uint8_t)(end - code);
            code = end++;
        }
    }
    frame[code] = (uint8_t)(end - code);
    frame[end++] = 0;
    return end;
}

/* What a command is: its unit is that of `volts` and of the command limit. */
#define FURUTA_VOLTAGE 0      /* V */
#define FURUTA_CURRENT 1      /* A */
#define FURUTA_TORQUE 2       /* N m */
#define FURUTA_ACCELERATION 3 /* rad/s2 of the arm: a stepper motor */

/* Who the rig is. `limits`: arm angle (rad), arm speed (rad/s), pendulum speed (rad/s); 0 or less: no limit. */
static size_t furuta_hello_of(uint8_t *frame, const char *rig, uint32_t period_us, int32_t arm_counts_per_rev, int32_t pendulum_counts_per_rev,
                              float command_limit, const float limits[3], uint16_t watchdog_periods, uint8_t actuation) {
    furuta_packet p = {{0}, 0};
    size_t name = strlen(rig);
    if (name > FURUTA_NAME_CAPACITY) name = FURUTA_NAME_CAPACITY;
    furuta_put(&p, 1);
    furuta_put_varint(&p, FURUTA_VERSION);
    furuta_put_varint(&p, name);
    for (size_t i = 0; i < name; i++) furuta_put(&p, (uint8_t)rig[i]);
    furuta_put_varint(&p, period_us);
    furuta_put_f64(&p, arm_counts_per_rev);
    furuta_put_f64(&p, pendulum_counts_per_rev);
    furuta_put_f32(&p, command_limit);
    for (int i = 0; i < 3; i++) {
        if (limits[i] > 0) {
            furuta_put(&p, 1);
            furuta_put_f32(&p, limits[i]);
        } else {
            furuta_put(&p, 0);
        }
    }
    furuta_put_varint(&p, watchdog_periods);
    if (actuation != FURUTA_VOLTAGE) furuta_put(&p, actuation);
    return furuta_frame(&p, frame);
}

/* The same of a rig whose command is a voltage. */
static inline size_t furuta_hello(uint8_t *frame, const char *rig, uint32_t period_us, int32_t arm_counts_per_rev,
                                  int32_t pendulum_counts_per_rev, float command_limit, const float limits[3], uint16_t watchdog_periods) {
    return furuta_hello_of(frame, rig, period_us, arm_counts_per_rev, pendulum_counts_per_rev, command_limit, limits, watchdog_periods, FURUTA_VOLTAGE);
}

/* One tick. */
static size_t furuta_sample(uint8_t *frame, uint32_t seq, uint64_t t_us, int32_t theta, int32_t alpha, float volts, uint8_t status) {
    furuta_packet p = {{0}, 0};
    furuta_put(&p, 2);
    furuta_put_varint(&p, seq);
    furuta_put_varint(&p, t_us);
    furuta_put_signed(&p, theta);
    furuta_put_signed(&p, alpha);
    furuta_put_f32(&p, volts);
    furuta_put(&p, status);
    return furuta_frame(&p, frame);
}

/* ---- receiving ---- */

typedef struct {
    uint8_t bytes[FURUTA_MAX_FRAME];
    uint8_t len, too_long;
} furuta_receiver;

typedef struct {
    uint16_t version; /* of FURUTA_QUERY: the host's. Answer it whatever it is: the hello tells the host yours. Not FURUTA_VERSION: motor off, obey no command until it is */
    uint32_t seq;     /* of FURUTA_COMMAND */
    float volts;      /* of FURUTA_COMMAND: may be NaN or infinite, see isfinite() */
} furuta_received;

enum { FURUTA_NOTHING, FURUTA_BAD, FURUTA_QUERY, FURUTA_COMMAND };

/* Reads a number of at most `bits` bits; returns the bytes read, 0 where it is none. */
static size_t furuta_get_varint(const uint8_t *bytes, size_t len, int bits, uint32_t *n) {
    *n = 0;
    for (size_t i = 0; i < len && 7 * (int)i < bits; i++) {
        int room = bits - 7 * (int)i;
        if (room < 7 && bytes[i] >> room) return 0;
        *n |= (uint32_t)(bytes[i] & 127) << (7 * i);
        if (bytes[i] < 128) return i + 1;
    }
    return 0;
}

/* Takes the next byte from the line and tells what it completes. */
static int furuta_receive(furuta_receiver *r, uint8_t byte, furuta_received *got) {
    if (byte) {
        if (r->len < FURUTA_MAX_FRAME) r->bytes[r->len++] = byte;
        else r->too_long = 1;
        return FURUTA_NOTHING;
    }
    size_t len = r->len, in = 0, out = 0;
    uint8_t too_long = r->too_long;
    r->len = r->too_long = 0;
    if (too_long) return FURUTA_BAD;
    if (len == 0) return FURUTA_NOTHING;
    /* COBS in place: what is written never overtakes what is read. */
    while (in < len) {
        size_t block = r->bytes[in++];
        if (block - 1 > len - in) return FURUTA_BAD;
        for (size_t i = 1; i < block; i++) r->bytes[out++] = r->bytes[in++];
        if (in < len) r->bytes[out++] = 0;
    }
    if (out < 4) return FURUTA_BAD;
    out -= 4;
    uint32_t crc = 0;
    for (int i = 0; i < 4; i++) crc |= (uint32_t)r->bytes[out + i] << (8 * i);
    if (out == 0 || crc != furuta_crc32(r->bytes, out)) return FURUTA_BAD;
    const uint8_t *body = r->bytes + 1;
    size_t left = out - 1, used;
    uint32_t n;
    if (r->bytes[0] == 0) {
        used = furuta_get_varint(body, left, 16, &n);
        if (!used || (n == FURUTA_VERSION && used != left)) return FURUTA_BAD;
        got->version = (uint16_t)n;
        return FURUTA_QUERY;
    }
    if (r->bytes[0] == 3) {
        used = furuta_get_varint(body, left, 32, &got->seq);
        if (!used || left - used != 4) return FURUTA_BAD;
        uint32_t bits = 0;
        for (int i = 0; i < 4; i++) bits |= (uint32_t)body[used + i] << (8 * i);
        memcpy(&got->volts, &bits, sizeof bits);
        return FURUTA_COMMAND;
    }
    return FURUTA_BAD;
}

/* `obeyed` before the first command. */
#define FURUTA_NONE_OBEYED 0xffffffffu

/* Whether a command answers one of the last samples, and a newer one than the command obeyed before: only such a one drives the motor and feeds the
 * watchdog. `next` is the number of the next sample. A repeated or late command, or one of the time before a reset, is no sign of life. */
static int furuta_is_news(uint32_t seq, uint32_t next, uint32_t *obeyed, uint16_t watchdog_periods) {
    uint32_t age = next - 1 - seq, oldest = next < watchdog_periods ? next : watchdog_periods;
    if (age >= oldest || age >= (uint32_t)(next - 1 - *obeyed)) return 0;
    *obeyed = seq;
    return 1;
}

#endif
