/* The chip with the sketch, in simavr: its line as bytes with their time on the wire, its driver pins as a voltage, its
 * encoder pins as counts. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include <simavr/sim_avr.h>

#define HZ 16000000u
#define SUPPLY 12.0 /* V at the driver, as in config.h */

/* The interrupts that the sketch uses. */
enum { ENCODERS, TICK, RECEIVED, SENT, INTERRUPTS };

typedef struct {
    uint64_t since;                   /* cycle of the request, or of the entry */
    uint32_t longest, longest_waited; /* cycles */
    uint64_t busy, last;              /* cycles, all together; when it began the last time */
} interrupt_time;

typedef struct {
    avr_t *avr;
    uint32_t ram_end; /* of static RAM: the stack comes from above */
    bool drives_by_direction;
    /* The line. */
    uint8_t to_board[4096];
    unsigned first, end;
    uint64_t next_byte;
    unsigned in_chip; /* received, not yet taken by the program */
    void (*on_byte)(uint8_t);
    /* Faults. */
    uint32_t hung_at;
    uint8_t hung_code[2];
    bool is_hung;
    void (*on_reset)(bool by_watchdog);
    int32_t counts[2];
    interrupt_time waits[INTERRUPTS], runs[INTERRUPTS];
} board;

/* `chip`: atmega328p or atmega2560. */
void board_start(board *b, const char *chip, const char *elf, bool drives_by_direction);
uint64_t board_cycle(const board *b);
/* Cycles that a byte takes on the wire. */
unsigned board_byte_cycles(const board *b);
/* Runs until this cycle. */
void board_run(board *b, uint64_t until);
/* Bytes from the host; each takes its time on the wire. What has no room is lost. */
void board_tell(board *b, const uint8_t *bytes, unsigned len);
/* Mean voltage that the driver gives the motor; `open`: its enable pin is low. */
double board_volts(const board *b, bool *open);
/* Turns an encoder (0 arm, 1 pendulum) to these counts, edge by edge. */
void board_turn(board *b, int axis, int32_t counts);
/* The reset button. */
void board_reset(board *b);
/* The program runs in a circle where it is, until a reset; `deaf`: with all interrupts off. */
void board_hang(board *b, bool deaf);

#endif
