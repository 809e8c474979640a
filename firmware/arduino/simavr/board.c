#include "board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_interrupts.h>

/* Addresses in data space and vectors, from the data sheets. */
enum { DDRB = 0x24, PORTB = 0x25, TCCR1A = 0x80, TCCR1B = 0x81, ICR1 = 0x86, OCR1A = 0x88, OCR1B = 0x8a };
enum { MCUSR = 0x54, UCSR0A = 0xc0, UCSR0B = 0xc1, UBRR0 = 0xc4 };

typedef struct {
    const char *name;
    int vector[INTERRUPTS];
    int pwm[2], enable, direction; /* bits of port B */
    char encoders;                 /* port */
} chip_pins;

static const chip_pins CHIPS[] = {
    {"atmega328p", {4, 7, 18, 19}, {1, 2}, 4, 2, 'C'},
    {"atmega2560", {9, 13, 25, 26}, {5, 6}, 4, 6, 'B'},
};
static const chip_pins *chip;
static board *the_board; /* for callbacks whose parameter is another */

static uint16_t word(const board *b, int at) { return b->avr->data[at] | b->avr->data[at + 1] << 8; }

uint64_t board_cycle(const board *b) { return b->avr->cycle; }

unsigned board_byte_cycles(const board *b) {
    unsigned per_bit = b->avr->data[UCSR0A] & 2 ? 8 : 16;
    return 10 * per_bit * ((word(b, UBRR0) & 0xfff) + 1);
}

static void quiet(avr_t *avr, const int level, const char *format, va_list args) {
    (void)avr;
    if (level <= LOG_ERROR) vfprintf(stderr, format, args);
}

static void on_out(avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    board *b = param;
    b->on_byte((uint8_t)value);
}

/* An interrupt is requested (1) or no longer (0). */
static void on_pending(avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    interrupt_time *t = param;
    uint64_t now = the_board->avr->cycle;
    if (value) {
        t->since = now;
    } else if (t->since) {
        uint32_t waited = (uint32_t)(now - t->since);
        if (waited > t->longest_waited) t->longest_waited = waited;
        t->since = 0;
    }
}

/* Its handler begins (1) or has ended (0). */
static void on_running(avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    interrupt_time *t = param;
    uint64_t now = the_board->avr->cycle;
    if (value) {
        t->since = now;
        if (t == &the_board->runs[RECEIVED] && the_board->in_chip) the_board->in_chip--;
    } else if (t->since) {
        uint32_t took = (uint32_t)(now - t->since);
        t->busy += took;
        if (took > t->longest) t->longest = took;
        if (took > t->longest / 4) t->last = t->since; /* timer 2 comes between ticks, too */
        t->since = 0;
    }
}

static void show_encoder(board *b, int axis) {
    static const uint8_t GRAY[] = {0, 1, 3, 2}; /* bit 0: A leads when counting up */
    uint8_t pins = GRAY[b->counts[axis] & 3];
    for (int i = 0; i < 2; i++) {
        avr_irq_t *pin = avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ(chip->encoders), 2 * axis + i);
        avr_raise_irq(pin, pins >> i & 1);
    }
    /* What the program finds there when it sets its pull-up resistors. */
    uint8_t shown = GRAY[b->counts[0] & 3] | GRAY[b->counts[1] & 3] << 2;
    avr_ioport_external_t driven = {.name = chip->encoders, .mask = 15, .value = shown};
    avr_ioctl(b->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(chip->encoders), &driven);
}

void board_start(board *b, const char *name, const char *elf, bool drives_by_direction) {
    memset(b, 0, sizeof *b);
    the_board = b;
    b->drives_by_direction = drives_by_direction;
    avr_global_logger_set(quiet);
    for (unsigned i = 0; i < sizeof CHIPS / sizeof *CHIPS; i++)
        if (!strcmp(CHIPS[i].name, name)) chip = &CHIPS[i];
    elf_firmware_t program = {0};
    if (!chip || elf_read_firmware(elf, &program) != 0 || !(b->avr = avr_make_mcu_by_name(name))) {
        fprintf(stderr, "bench: cannot start %s on a chip %s\n", elf, name);
        exit(1);
    }
    avr_init(b->avr);
    b->ram_end = (strcmp(name, "atmega2560") ? 0x100 : 0x200) + program.datasize + program.bsssize;
    program.frequency = HZ;
    avr_load_firmware(b->avr, &program);
    uint32_t flags = 0; /* no sleeping, no printing */
    avr_ioctl(b->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(b->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_out, b);
    for (int i = 0; i < INTERRUPTS; i++) {
        avr_irq_t *irq = avr_get_interrupt_irq(b->avr, chip->vector[i]);
        avr_irq_register_notify(irq + AVR_INT_IRQ_PENDING, on_pending, &b->waits[i]);
        avr_irq_register_notify(irq + AVR_INT_IRQ_RUNNING, on_running, &b->runs[i]);
    }
    for (int axis = 0; axis < 2; axis++) show_encoder(b, axis);
}

static void after_reset(board *b) {
    if (b->is_hung) memcpy(b->avr->flash + b->hung_at, b->hung_code, 2);
    b->is_hung = false;
    b->first = b->end = 0;
    b->next_byte = b->in_chip = 0;
    for (int i = 0; i < INTERRUPTS; i++) b->waits[i].since = b->runs[i].since = 0;
    for (int axis = 0; axis < 2; axis++) show_encoder(b, axis);
}

/* The next byte from the host, when it has passed the wire. simavr begins with a byte when the one before is taken, so
 * bytes wait here and not in its own buffer. */
static void receive(board *b) {
    if (b->first == b->end || board_cycle(b) < b->next_byte || b->in_chip == 2) return;
    uint8_t byte = b->to_board[b->first++ % sizeof b->to_board];
    b->next_byte = board_cycle(b) + board_byte_cycles(b);
    if (!(b->avr->data[UCSR0B] & 0x10)) return; /* the receiver is off: nothing is there to hear it */
    b->in_chip++;
    avr_raise_irq(avr_io_getirq(b->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), byte);
}

void board_run(board *b, uint64_t until) {
    avr_t *avr = b->avr;
    while (board_cycle(b) < until) {
        receive(b);
        int state = avr_run(avr);
        if (avr->pc == 0) { /* simavr resets on the watchdog by itself */
            after_reset(b);
            if (b->on_reset) b->on_reset(avr->data[MCUSR] & 8);
        }
        if (state == cpu_Crashed || state == cpu_Done) {
            fprintf(stderr, "bench: the program crashed at %#x\n", (unsigned)avr->pc);
            exit(1);
        }
    }
}

void board_tell(board *b, const uint8_t *bytes, unsigned len) {
    for (unsigned i = 0; i < len && b->end - b->first < sizeof b->to_board; i++)
        b->to_board[b->end++ % sizeof b->to_board] = bytes[i];
}

/* Share of the time for which a pin is high. */
static double share(const board *b, int channel) {
    const uint8_t *io = b->avr->data;
    int bit = chip->pwm[channel];
    if (!(io[DDRB] >> bit & 1)) return 0; /* an input: the resistor pulls it down */
    bool by_timer = (io[TCCR1A] >> (channel ? 4 : 6) & 3) == 2;
    if (!by_timer) return io[PORTB] >> bit & 1;
    /* Phase correct with its top in ICR1 (mode 10), undivided clock: what the sketch says it does. */
    int mode = (io[TCCR1A] & 3) | (io[TCCR1B] >> 1 & 12);
    if (mode != 10 || (io[TCCR1B] & 7) != 1 || word(b, ICR1) != 400) return 0.0 / 0.0;
    return (double)word(b, channel ? OCR1B : OCR1A) / word(b, ICR1);
}

double board_volts(const board *b, bool *open) {
    const uint8_t *io = b->avr->data;
    *open = !(io[DDRB] >> chip->enable & 1 && io[PORTB] >> chip->enable & 1);
    if (*open) return 0;
    double a = share(b, 0), c = share(b, 1);
    if (b->drives_by_direction) return io[PORTB] >> chip->direction & 1 ? -SUPPLY * a : SUPPLY * a;
    return SUPPLY * (a - c);
}

void board_turn(board *b, int axis, int32_t counts) {
    while (b->counts[axis] != counts) {
        b->counts[axis] += b->counts[axis] < counts ? 1 : -1;
        show_encoder(b, axis);
    }
}

void board_reset(board *b) {
    avr_reset(b->avr);
    after_reset(b);
    if (b->on_reset) b->on_reset(false);
}

void board_hang(board *b, bool deaf) {
    avr_t *avr = b->avr;
    while (avr->interrupts.running_ptr) avr_run(avr);
    b->hung_at = avr->pc;
    memcpy(b->hung_code, avr->flash + b->hung_at, 2);
    memcpy(avr->flash + b->hung_at, "\xff\xcf", 2); /* rjmp to itself */
    b->is_hung = true;
    if (deaf) avr->sreg[S_I] = 0;
}
