/* Test program around docs/furuta_wire.h: each line of input asks for a frame, or brings bytes from the line. */
#include "furuta_wire.h"

#include <inttypes.h>
#include <stdio.h>

static float from_bits(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void print(const uint8_t *bytes, size_t len) {
    for (size_t i = 0; i < len; i++) printf("%02x", bytes[i]);
    printf("\n");
}

int main(void) {
    uint8_t frame[FURUTA_MAX_FRAME];
    furuta_receiver in = {{0}, 0, 0};
    uint32_t obeyed = FURUTA_NONE_OBEYED;
    char kind;
    while (scanf(" %c", &kind) == 1) {
        if (kind == 's') {
            uint32_t seq, volts, status;
            uint64_t t;
            int32_t theta, alpha;
            if (scanf("%" SCNu32 "%" SCNu64 "%" SCNd32 "%" SCNd32 "%" SCNu32 "%" SCNu32, &seq, &t, &theta, &alpha, &volts, &status) != 6) return 1;
            print(frame, furuta_sample(frame, seq, t, theta, alpha, from_bits(volts), (uint8_t)status));
        } else if (kind == 'h') {
            char name[64];
            uint32_t period, volts, watchdog, actuation, limit[3];
            int32_t arm, pendulum;
            if (scanf("%63s%" SCNu32 "%" SCNd32 "%" SCNd32 "%" SCNu32 "%" SCNu32 "%" SCNu32 "%" SCNu32 "%" SCNu32 "%" SCNu32, name, &period, &arm, &pendulum, &volts,
                      &limit[0], &limit[1], &limit[2], &watchdog, &actuation) != 10) return 1;
            float limits[3] = {from_bits(limit[0]), from_bits(limit[1]), from_bits(limit[2])};
            print(frame, furuta_hello_of(frame, name, period, arm, pendulum, from_bits(volts), limits, (uint16_t)watchdog, (uint8_t)actuation));
        } else if (kind == 'a') {
            uint32_t seq, next, watchdog;
            if (scanf("%" SCNu32 "%" SCNu32 "%" SCNu32, &seq, &next, &watchdog) != 3) return 1;
            printf("%d\n", furuta_is_news(seq, next, &obeyed, (uint16_t)watchdog));
        } else if (kind == 'r') {
            unsigned byte;
            if (scanf("%x", &byte) != 1) return 1;
            furuta_received got;
            uint32_t bits;
            switch (furuta_receive(&in, (uint8_t)byte, &got)) {
            case FURUTA_BAD: printf("bad\n"); break;
            case FURUTA_QUERY: printf("query %u\n", (unsigned)got.version); break;
            case FURUTA_COMMAND:
                memcpy(&bits, &got.volts, sizeof bits);
                printf("command %" PRIu32 " %" PRIu32 "\n", got.seq, bits);
                break;
            default: break;
            }
        } else {
            return 1;
        }
    }
    return 0;
}
