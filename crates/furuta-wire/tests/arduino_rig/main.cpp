// The sketch's end of the wire (firmware/arduino/furuta_rig/rig_end.h) on a computer: one line in, at most one out.
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "rig_end.h"

int main() {
    static RigEnd rig;
    char kind;
    while (scanf(" %c", &kind) == 1) {
        uint32_t seq, bits;
        int32_t theta, alpha;
        if (kind == 'c' && scanf("%" SCNu32 " %" SCNu32, &seq, &bits) == 2) {
            float volts;
            memcpy(&volts, &bits, sizeof volts);
            rig.command(seq, volts);
        } else if (kind == 'q' && scanf("%" SCNu32, &seq) == 1) {
            rig.query(uint16_t(seq));
        } else if (kind == 't' && scanf("%" SCNd32 " %" SCNd32, &theta, &alpha) == 2) {
            Sample sample;
            rig.tick(0, theta, alpha, sample);
            memcpy(&bits, &sample.volts, sizeof bits);
            printf("%" PRIu32 " %" PRIu32 " %d\n", sample.seq, bits, sample.status);
        } else {
            return 1;
        }
    }
    return 0;
}
