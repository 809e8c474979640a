/* bench CHIP ELF [--direction] [--usb MICROSECONDS] [--measure]
 *
 * Runs the sketch in simavr at its 16 MHz, its line on a pseudo-terminal, with a simulated rig on its pins. Prints the
 * pseudo-terminal's name, then a line whenever the motor goes on or off and at each reset. Takes commands from standard
 * input, one a line, and ends where that ends: reset, hang, hang deaf, state. `--usb`: an adapter holds what passes for
 * so long, each way. `--direction`: the driver is one of PWM_AND_DIRECTION. `--measure`: prints what the sketch costs,
 * and ends.
 *
 * The simulated time is never faster than this machine's, and it stands still while the host thinks about a sample, as
 * long as it answered the one before: no run depends on how busy this machine is. */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "board.h"
#include "cable.h"
#include "measure.h"
#include "plant.h"

#define STEP 800    /* cycles of the board between two steps of the rig: 50 us */
#define COUNTS 4096 /* per turn, as in config.h */
#define TURN 6.283185307179586

static board b;
static cable line;

static double seconds(void) { return (double)board_cycle(&b) / HZ; }

static void say(const char *what) {
    printf("%.4f %s\n", seconds(), what);
    fflush(stdout);
}

static void on_byte(uint8_t byte) { cable_byte(&line, board_cycle(&b), byte); }

static void on_reset(bool by_watchdog) { say(by_watchdog ? "reset by its watchdog" : "reset by the button"); }

static void tell(const uint8_t *bytes, unsigned len) { board_tell(&b, bytes, len); }

static double wall(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Keeps the board from running faster than real time; what was lost is not caught up with. */
static void pace(void) {
    static double began;
    double ahead = began + seconds() - wall();
    if (ahead < 0) {
        began -= ahead;
    } else if (ahead > 0.0005) {
        struct timespec pause = {0, (long)(ahead * 1e9)};
        nanosleep(&pause, NULL);
    }
}

/* A whole line from standard input, if there is one. */
static bool command(char *text, size_t size) {
    static size_t len;
    char byte;
    for (;;) {
        ssize_t n = read(STDIN_FILENO, &byte, 1);
        if (n == 0) exit(0);
        if (n < 0) return false;
        if (byte != '\n') {
            if (len + 1 < size) text[len++] = byte;
            continue;
        }
        text[len] = 0;
        len = 0;
        return true;
    }
}

static void obey(const char *text, double volts, bool open, const plant_state *x) {
    char state[128];
    if (!strcmp(text, "reset")) {
        board_reset(&b);
    } else if (!strcmp(text, "hang") || !strcmp(text, "hang deaf")) {
        board_hang(&b, text[4] != 0);
        say("hangs");
    } else if (!strcmp(text, "state")) {
        snprintf(state, sizeof state, "state: %.3f V%s, arm %.4f rad, pendulum %.4f rad", volts,
                 open ? " (driver off)" : "", x->theta, x->alpha);
        say(state);
    } else {
        fprintf(stderr, "bench: reset, hang, hang deaf or state, not: %s\n", text);
    }
}

static void run(const char *chip, const char *elf, bool by_direction, double usb_us) {
    board_start(&b, chip, elf, by_direction);
    b.on_byte = on_byte;
    b.on_reset = on_reset;
    cable_open(&line, (uint64_t)(usb_us * 1e-6 * HZ));
    fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    plant_state x = {0, TURN / 2, 0, 0};
    bool was_on = false;
    char text[64];
    for (uint64_t step = 1;; step++) {
        board_run(&b, step * STEP);
        bool open;
        double volts = board_volts(&b, &open);
        bool is_on = volts != 0;
        if (is_on != was_on) say(is_on ? "motor on" : "motor off");
        was_on = is_on;
        plant_step(&x, volts, open, (double)STEP / HZ);
        board_turn(&b, 0, (int32_t)lround(x.theta * COUNTS / TURN));
        board_turn(&b, 1, (int32_t)lround((x.alpha - TURN / 2) * COUNTS / TURN));
        cable_pass(&line, board_cycle(&b), tell);
        if (step % 20 != 0) continue;
        pace();
        if (command(text, sizeof text)) obey(text, volts, open, &x);
    }
}

int main(int argc, char **argv) {
    bool by_direction = false, measures = false, is_wrong = argc < 3;
    double usb_us = 0;
    for (int i = 3; i < argc; i++) {
        if (!strcmp(argv[i], "--direction")) by_direction = true;
        else if (!strcmp(argv[i], "--measure")) measures = true;
        else if (!strcmp(argv[i], "--usb") && i + 1 < argc) usb_us = atof(argv[++i]);
        else is_wrong = true;
    }
    if (is_wrong) {
        fprintf(stderr, "bench CHIP ELF [--direction] [--usb MICROSECONDS] [--measure]\n");
        return 2;
    }
    if (measures) measure(argv[1], argv[2]);
    else run(argv[1], argv[2], by_direction, usb_us);
}
