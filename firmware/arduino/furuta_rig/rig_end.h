// The rig's end of the wire: what the motor gets at each tick, and why (docs/protocol.md). Watchdog, command limit, the
// limits of angle and speed. No I/O, no clock; whole numbers where the tick's interrupt computes.
#ifndef RIG_END_H
#define RIG_END_H

#include <math.h>

#include "config.h"
#include "furuta_wire.h"

constexpr uint16_t PERIOD_US = 1000u * PERIOD_MS;
constexpr int16_t PWM_TOP = 400;          // full PWM
constexpr uint8_t SPEED_WINDOW = 10;      // periods: a single count per period is already fast
constexpr uint16_t BRAKING_TICKS = 250000UL / PERIOD_US;  // a command may brake beyond a limit for so long

static_assert(ARM_COUNTS != 0 && PENDULUM_COUNTS != 0, "counts per turn");
static_assert(COMMAND_LIMIT > 0 && COMMAND_LIMIT <= SUPPLY, "the command limit is what the supply can give, at most");
static_assert(PERIOD_MS >= 1 && WATCHDOG_PERIODS >= 1 && WATCHDOG_PERIODS < 255, "period and watchdog");
static_assert(sizeof RIG_NAME > 1 && sizeof RIG_NAME <= FURUTA_NAME_CAPACITY + 1, "the name has 1 to 32 bytes");

// The largest count within a limit.
constexpr int32_t within(float limit, int32_t counts) {
    return limit > 0 ? int32_t(limit * (counts < 0 ? -counts : counts) / 6.2831853f) : INT32_MAX;
}
constexpr float WINDOW_S = SPEED_WINDOW * (PERIOD_US * 1e-6f);
constexpr int32_t MOST_ARM = within(ARM_ANGLE_LIMIT, ARM_COUNTS);
constexpr int32_t MOST_ARM_MOVED = within(ARM_SPEED_LIMIT * WINDOW_S, ARM_COUNTS);
constexpr int32_t MOST_PENDULUM_MOVED = within(PENDULUM_SPEED_LIMIT * WINDOW_S, PENDULUM_COUNTS);

// A voltage and the PWM that makes it; negative backward.
struct Drive {
    float volts;
    int16_t duty;
};
constexpr Drive OFF = {0, 0};

struct Sample {
    uint32_t seq;
    uint64_t t_us;
    int32_t theta, alpha;
    float volts;
    uint8_t status;
};

class RigEnd {
   public:
    // A host's command, which may be anything. Not while the tick's interrupt may come.
    void command(uint32_t seq, float volts) {
        if (foreign_) {
            refused_ = true;
        } else if (isfinite(volts) && furuta_is_news(seq, seq_, &obeyed_, WATCHDOG_PERIODS)) {
            ask(volts, true);
        } else if (volts == 0) {
            ask(0, asked_ && feeds_);  // off is always allowed, and is no sign of life
        } else {
            refused_ = true;
        }
    }

    // A host's query. What one of another version means by a command is not known: none is obeyed.
    void query(uint16_t version) {
        foreign_ = version != FURUTA_VERSION;
        if (foreign_) asked_ = feeds_ = commanded_ = false;
    }

    // One tick: returns what the motor must get from now on.
    Drive tick(uint64_t t_us, int32_t theta, int32_t alpha, Sample &sample) {
        uint8_t status = refused_ ? FURUTA_REFUSED : 0;
        if (asked_) {
            held_ = asked_for_;
            if (clipped_) status |= FURUTA_CLIPPED;
        }
        if (feeds_) {
            silent_ = 0;
            commanded_ = true;
        } else {
            if (silent_ < 255) silent_++;
            status |= FURUTA_HELD;
        }
        refused_ = asked_ = feeds_ = clipped_ = false;
        if (!commanded_ || silent_ >= WATCHDOG_PERIODS) {
            held_ = OFF;
            status |= FURUTA_WATCHDOG;
        }
        int16_t moved = 0;
        if (is_beyond(theta, alpha, moved)) {
            status |= FURUTA_LIMIT;
            if (beyond_ <= BRAKING_TICKS) beyond_++;
            if (!brakes(theta, moved)) held_ = OFF;
        } else {
            beyond_ = 0;
        }
        sample = {seq_++, t_us, theta, alpha, held_.volts, status};
        return held_;
    }

   private:
    void ask(float volts, bool feeds) {
        clipped_ = fabs(volts) > COMMAND_LIMIT;
        if (clipped_) volts = volts < 0 ? -COMMAND_LIMIT : COMMAND_LIMIT;
        asked_for_ = {volts, int16_t(lround(volts * (PWM_TOP / SUPPLY)))};
        asked_ = true;
        feeds_ = feeds;
    }

    // Speeds are the counts moved over the window; 16 bits hold them.
    bool is_beyond(int32_t theta, int32_t alpha, int16_t &arm_moved) {
        int16_t pendulum_moved = 0;
        uint16_t *old = recent_[newest_];
        if (full_) {
            arm_moved = int16_t(uint16_t(theta) - old[0]);
            pendulum_moved = int16_t(uint16_t(alpha) - old[1]);
        }
        old[0] = uint16_t(theta);
        old[1] = uint16_t(alpha);
        if (++newest_ == SPEED_WINDOW) {
            newest_ = 0;
            full_ = true;
        }
        return size(theta) > uint32_t(MOST_ARM) || size(arm_moved) > uint32_t(MOST_ARM_MOVED) ||
               size(pendulum_moved) > uint32_t(MOST_PENDULUM_MOVED);
    }

    // Whether the voltage held does nothing beyond a limit but to stop an arm on its way out, and not for too long.
    bool brakes(int32_t theta, int16_t moved) const {
        bool forward = (moved > 0) == (ARM_COUNTS > 0);
        bool against = moved != 0 && held_.volts != 0 && (held_.volts < 0) == forward;
        bool outwards = (theta > 0 && moved > 0) || (theta < 0 && moved < 0);
        bool outside = size(theta) > uint32_t(MOST_ARM);
        return beyond_ <= BRAKING_TICKS && against && (outwards || !outside);
    }

    static uint32_t size(int32_t n) { return n < 0 ? 0 - uint32_t(n) : uint32_t(n); }

    uint32_t seq_ = 0, obeyed_ = FURUTA_NONE_OBEYED;
    Drive held_ = OFF, asked_for_ = OFF;
    bool asked_ = false, feeds_ = false, clipped_ = false, refused_ = false;
    bool commanded_ = false, foreign_ = false, full_ = false;
    uint8_t silent_ = 0, newest_ = 0;
    uint16_t beyond_ = 0;  // ticks in a row beyond a limit
    uint16_t recent_[SPEED_WINDOW][2] = {};
};

#endif
