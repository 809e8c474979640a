// The rig's end of the furuta wire on an Arduino Uno, Nano or Mega: docs/arduino.md. Edit config.h, then upload.
//
// The tick is an interrupt: it latches the newest command, reads the encoders, drives the motor. Everything that takes
// long (frames, checksums) is done in loop(), and whatever loop() does, the tick takes the motor off when commands stay
// away. A loop() that hangs is reset.

#include "config.h"
#include "rig_end.h"
#include "board.h"
#include "line.h"

static RigEnd rig;
static Sample sample;            // of the last tick
static volatile bool is_sample;  // it was not sent yet
static furuta_receiver receiver;
static uint8_t hello[FURUTA_MAX_FRAME], hello_len;  // made once: a host asks ten times a second to time the line
static bool hello_due;

ISR(TIMER2_COMPA_vect) {
    static uint8_t ms;
    if (++ms < PERIOD_MS) return;
    ms = 0;
    uint16_t arm = edges_arm, pendulum = edges_pendulum;
    uint8_t late = TCNT2;
    {
        // Encoders and line are served while the tick computes; another tick is far away.
        sei();
        static Wide theta, alpha;
        static uint64_t due_us;
        due_us += PERIOD_US;
        drive(rig.tick(due_us + late * TIMER_US, theta.follow(arm), alpha.follow(pendulum), sample).duty);
        is_sample = true;
        cli();
    }
}

static void make_hello() {
    const float limits[] = {ARM_ANGLE_LIMIT, ARM_SPEED_LIMIT, PENDULUM_SPEED_LIMIT};
    hello_len = furuta_hello(hello, RIG_NAME, PERIOD_US, ARM_COUNTS, PENDULUM_COUNTS, COMMAND_LIMIT, limits,
                             WATCHDOG_PERIODS);
}

void setup() {
    cli();
    make_hello();
    motor_begin();
    encoders_begin();
    line_begin();
    hang_watch();
    period_begin();
    sei();
}

static void send_sample() {
    Sample s;
    {
        NoTick wait;
        s = sample;
        is_sample = false;
    }
    uint8_t frame[FURUTA_MAX_FRAME];
    send(frame, furuta_sample(frame, s.seq, s.t_us, s.theta, s.alpha, s.volts, s.status));
    wdt_reset();  // ticks come, and are sent
}

static void receive(uint8_t byte) {
    furuta_received got;
    switch (furuta_receive(&receiver, byte, &got)) {
    case FURUTA_QUERY: {
        NoTick wait;
        rig.query(got.version);
        hello_due = true;
        break;
    }
    case FURUTA_COMMAND: {
        NoTick wait;
        rig.command(got.seq, got.volts);
        break;
    }
    default: break;
    }
}

void loop() {
    if (is_sample) send_sample();
    else if (!inbox.is_empty()) receive(inbox.take());
    else if (hello_due) {
        send(hello, hello_len);
        hello_due = false;
    }
}
