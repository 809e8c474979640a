// Pins and timers of an ATmega328P (Uno, Nano) or an ATmega2560 (Mega) at 16 MHz. Timer 1 makes the PWM, timer 2 the
// period; timer 0, which the Arduino core uses for millis(), is stopped.
#ifndef BOARD_H
#define BOARD_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "rig_end.h"

#if F_CPU != 16000000UL
#error "the timers are set up for a clock of 16 MHz"
#endif

// Encoders: four pins of one port, whose pin-change interrupt sees all edges. Bits 0, 1: arm A, B; 2, 3: pendulum A, B.
#if defined(__AVR_ATmega328P__)
#define ENCODER_PINS PINC  // A0 to A3
#define ENCODER_PULL_UPS PORTC
#define ENCODER_MASK PCMSK1
#define ENCODER_BIT PCIE1
#define ENCODER_vect PCINT1_vect
constexpr uint8_t PWM_A = 1, PWM_B = 2, ENABLE = 4, LED = 5;  // of port B: D9, D10, D12, D13
#define LINE_RX_vect USART_RX_vect
#define LINE_UDRE_vect USART_UDRE_vect
#elif defined(__AVR_ATmega2560__)
#define ENCODER_PINS PINB  // D53, D52, D51, D50
#define ENCODER_PULL_UPS PORTB
#define ENCODER_MASK PCMSK0
#define ENCODER_BIT PCIE0
#define ENCODER_vect PCINT0_vect
constexpr uint8_t PWM_A = 5, PWM_B = 6, ENABLE = 4, LED = 7;  // of port B: D11, D12, D10, D13
#define LINE_RX_vect USART0_RX_vect
#define LINE_UDRE_vect USART0_UDRE_vect
#else
#error "no pins are given for this chip: ATmega328P (Uno, Nano) and ATmega2560 (Mega) have them"
#endif

// ---- motor ----

// In reset the pins are inputs and the resistor at the driver's enable pin holds it off; the first tick switches it on.
inline void motor_begin() {
    PORTB = 0;
    TCCR1A = TCCR1B = 0;
    OCR1A = OCR1B = 0;
    ICR1 = PWM_TOP;
    // Phase correct, top in ICR1, clock undivided: 16 MHz / (2 * 400) = 20 kHz; 0 is no pulse at all.
    TCCR1A = _BV(COM1A1) | (DRIVE == TWO_PWM ? _BV(COM1B1) : 0) | _BV(WGM11);
    TCCR1B = _BV(WGM13) | _BV(CS10);
    DDRB = _BV(PWM_A) | _BV(PWM_B) | _BV(ENABLE) | _BV(LED);
}

// Between its pulses the motor is shorted, not open: only so is its mean voltage the duty's share of the supply. Two
// inputs that are both high do that, also in a DRV8871, where both low would leave it open.
inline void drive(int16_t duty) {
#if DRIVE == TWO_PWM
    OCR1A = duty < 0 ? PWM_TOP + duty : PWM_TOP;
    OCR1B = duty > 0 ? PWM_TOP - duty : PWM_TOP;
#else
    if (duty < 0) PORTB |= _BV(PWM_B);
    else PORTB &= ~_BV(PWM_B);
    OCR1A = duty < 0 ? -duty : duty;
#endif
    PORTB |= _BV(ENABLE);
}

// ---- encoders ----

static volatile uint16_t edges_arm, edges_pendulum;

// Where a channel pair goes from `old` to `now` (bits B, A each): 1, -1, 0, or 2: an edge was missed.
static const int8_t STEP[16] = {0, 1, -1, 2, -1, 0, 2, 1, 1, 2, 0, -1, 2, -1, 1, 0};

ISR(ENCODER_vect) {
    uint8_t old = GPIOR0, now = ENCODER_PINS & 15;
    GPIOR0 = now;
    uint8_t changed = old ^ now;
    if (changed & 3) {
        int8_t step = STEP[uint8_t((old & 3) << 2 | (now & 3))];
        if (step == 2) PORTB |= _BV(LED);
        else edges_arm += step;
    }
    if (changed & 12) {
        int8_t step = STEP[uint8_t((old & 12) | now >> 2)];
        if (step == 2) PORTB |= _BV(LED);
        else edges_pendulum += step;
    }
}

inline void encoders_begin() {
    ENCODER_PULL_UPS |= 15;
    ENCODER_MASK = 15;
    GPIOR0 = ENCODER_PINS & 15;
    PCIFR = _BV(ENCODER_BIT);
    PCICR = _BV(ENCODER_BIT);
}

// The edges counted in 16 bits, made wider: between two ticks no encoder turns by half of them.
class Wide {
   public:
    int32_t follow(uint16_t now) {
        total_ += int16_t(now - last_);
        last_ = now;
        return total_;
    }

   private:
    uint16_t last_ = 0;
    int32_t total_ = 0;
};

// ---- period ----

// Timer 2 counts to 250 in steps of 4 us: an interrupt each millisecond.
constexpr uint8_t TIMER_US = 4;

inline void period_begin() {
    TIMSK0 = 0;
    ASSR = 0;
    TCCR2A = _BV(WGM21);
    OCR2A = 249;
    TCNT2 = 0;
    TIFR2 = _BV(OCF2A);
    TIMSK2 = _BV(OCIE2A);
    TCCR2B = _BV(CS22);
}

// While one lives the tick waits; the encoders' and the line's interrupts go on.
class NoTick {
   public:
    NoTick() {
        TIMSK2 = 0;
        __asm__ volatile("" ::: "memory");
    }
    ~NoTick() {
        __asm__ volatile("" ::: "memory");
        TIMSK2 = _BV(OCIE2A);
    }
    NoTick(const NoTick &) = delete;
};

// ---- hang ----

// A loop that sends no sample for 15 ms is reset by the chip's own watchdog. It stays on in a reset that it made, so it
// is stopped first thing.
static_assert(PERIOD_MS <= 6, "the watchdog's 15 ms (-20 %) must be two periods: see hang_watch");
inline void hang_watch() { wdt_enable(WDTO_15MS); }

extern "C" void stop_watchdog(void) __attribute__((naked, used, section(".init3")));
extern "C" void stop_watchdog(void) {
    MCUSR = 0;
    wdt_disable();
}

#endif
