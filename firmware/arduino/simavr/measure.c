#include "measure.h"

#include <stdio.h>
#include <string.h>

#include "board.h"
#include "host.h"

#define UNTOUCHED 0xa5 /* stack is painted with it */

static board b;

/* A host that answers each sample at once, and what it saw of the board. */
static struct {
    uint8_t frame[256];
    size_t len;
    uint64_t began, tick, longest_to_line, longest_on_line;
    host_sample last;
    unsigned samples, gaps, refused, late;
} host;

static void on_byte(uint8_t byte) {
    if (host.len == 0) {
        host.began = board_cycle(&b);
        host.tick = b.runs[TICK].last;
    }
    if (host.len < sizeof host.frame) host.frame[host.len++] = byte;
    if (byte) return;
    host_sample s;
    if (host_reads(host.frame, host.len, &s)) {
        if (host.began - host.tick > host.longest_to_line) host.longest_to_line = host.began - host.tick;
        if (board_cycle(&b) - host.tick > host.longest_on_line) host.longest_on_line = board_cycle(&b) - host.tick;
        if (host.samples && s.seq != host.last.seq + 1) host.gaps++;
        if (host.samples > 2) host.refused += s.status & 16 ? 1 : 0, host.late += s.status & 1;
        host.last = s;
        host.samples++;
        uint8_t answer[64];
        size_t len = host_command(answer, s.seq, s.seq & 1 ? 3.21f : -4.56f);
        board_tell(&b, answer, (unsigned)len);
    }
    host.len = 0;
}

static void start(const char *chip, const char *elf) {
    memset(&host, 0, sizeof host);
    board_start(&b, chip, elf, false);
    b.on_byte = on_byte;
}

/* Turns the encoders by a count every so many cycles, there and back, for `seconds`; true if no count is lost. */
static bool keeps_up(const char *chip, const char *elf, unsigned axes, uint64_t cycles, double seconds) {
    start(chip, elf);
    uint64_t now = HZ / 20, end = now + (uint64_t)(seconds * HZ);
    board_run(&b, now);
    int32_t at = 0, way = 1;
    for (; now < end; now += cycles) {
        board_run(&b, now);
        at += way;
        if (at == 15000 || at == -15000) way = -way;
        for (unsigned axis = 0; axis < 2; axis++) {
            if (axis == 1) board_run(&b, now + cycles / 2);
            if (axes >> axis & 1) board_turn(&b, (int)axis, at);
        }
    }
    board_run(&b, end + HZ / 50);
return host.last.counts[0] == (axes & 1 ? at : 0) && host.last.counts[1] == (axes & 2 ? at : 0) && !host.gaps;
}

/* Faster in steps of 3 % until counts are lost. */
static unsigned largest_rate(const char *chip, const char *elf, unsigned axes) {
    double cycles = 800;
    while (keeps_up(chip, elf, axes, (uint64_t)(0.97 * cycles), 0.3)) cycles *= 0.97;
    return (unsigned)(HZ / cycles);
}

/* Turned at a steady rate that a fast rig reaches. */
#define FAST 20000 /* counts per second */

/* A second of both encoders turning; `asks`: queries among the commands. */
static void turn(bool asks) {
    static const uint8_t QUERY[] = {0, 1, 6, 1, 0x69, 0x22, 0xde, 0x36, 0};
    host.longest_to_line = host.longest_on_line = host.late = 0;
    uint64_t now = board_cycle(&b);
    for (int i = 0; i < FAST; i++) {
        board_run(&b, now += HZ / FAST);
        board_turn(&b, 0, b.counts[0] + 1);
        board_turn(&b, 1, b.counts[1] - 1);
        if (asks && i % 4000 == 0) board_tell(&b, QUERY, sizeof QUERY);
    }
    printf("%u samples until then, %u lost; %u commands late\n", host.samples, host.gaps, host.late);
    printf("from the tick to the sample's first byte %.0f us at most, to its last %.0f us\n",
           (double)host.longest_to_line * 1e6 / HZ, (double)host.longest_on_line * 1e6 / HZ);
}

void measure(const char *chip, const char *elf) {
    start(chip, elf);
    uint32_t top = b.avr->ramend, bottom = b.ram_end;
    memset(b.avr->data + bottom, UNTOUCHED, top + 1 - bottom);
    board_run(&b, HZ / 10);
    for (int i = 0; i < INTERRUPTS; i++) b.runs[i].busy = 0;
    printf("%s, both encoders at %d counts/s, the host answers each sample at once\n", chip, FAST);
    turn(false);
    printf("%-34s %8s %8s %11s\n", "interrupt", "cycles", "us", "of the time");
    static const char *const NAMES[INTERRUPTS] = {
        "an encoder's edge", "tick (others may interrupt it)", "byte received", "byte sent"};
    for (int i = 0; i < INTERRUPTS; i++)
        printf("%-34s %8u %8.1f %9.1f %%\n", NAMES[i], b.runs[i].longest, b.runs[i].longest * 1e6 / HZ,
               100 * (double)b.runs[i].busy / HZ);
    printf("longest wait: an edge %u cycles, the tick %u, a received byte %u (lost after two more, %u)\n",
           b.waits[ENCODERS].longest_waited, b.waits[TICK].longest_waited, b.waits[RECEIVED].longest_waited,
           2 * board_byte_cycles(&b));
    printf("with five queries:\n");
    turn(true);
    uint32_t deepest = bottom;
    while (deepest <= top && b.avr->data[deepest] == UNTOUCHED) deepest++;
    printf("stack: %u bytes at most of %u\n", top + 1 - deepest, top + 1 - bottom);
    printf("largest rate without a lost count: one encoder %u counts/s", largest_rate(chip, elf, 1));
    printf(", both %u counts/s each\n", largest_rate(chip, elf, 3));
}
