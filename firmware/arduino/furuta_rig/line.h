// The serial line: USART 0 with a ring of bytes each way, emptied and filled by interrupts.
#ifndef LINE_H
#define LINE_H

#include "board.h"

static_assert(F_CPU % (8 * BAUD) == 0, "16 MHz makes this baud rate only nearly: take 250000, 500000 or 1000000");

// One side puts, the other takes. 256 bytes, so that an index wraps by itself.
class Ring {
   public:
    bool is_empty() const { return first_ == end_; }
    uint8_t room() const { return uint8_t(first_ - end_ - 1); }
    // What has no room is lost: its frame then has a wrong checksum.
    void put(uint8_t byte) {
        if (room() == 0) return;
        bytes_[end_] = byte;
        end_ = end_ + 1;
    }
    uint8_t take() {
        uint8_t byte = bytes_[first_];
        first_ = first_ + 1;
        return byte;
    }

   private:
    volatile uint8_t bytes_[256];
    volatile uint8_t first_ = 0, end_ = 0;
};

static Ring inbox, outbox;

ISR(LINE_RX_vect) { inbox.put(UDR0); }

ISR(LINE_UDRE_vect) {
    if (outbox.is_empty()) UCSR0B &= ~_BV(UDRIE0);
    else UDR0 = outbox.take();
}

inline void line_begin() {
    UCSR0A = _BV(U2X0);
    UBRR0 = F_CPU / (8 * BAUD) - 1;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

// A whole frame or none of it.
inline void send(const uint8_t *frame, uint8_t len) {
    if (outbox.room() < len) return;
    while (len--) outbox.put(*frame++);
    uint8_t sreg = SREG;
    cli();
    UCSR0B |= _BV(UDRIE0);
    SREG = sreg;
}

#endif
