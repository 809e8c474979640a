// The rig: the one file to edit. As committed it describes Quanser's SRV02 with its pendulum, as the built-in rig file
// shahzad2022-srv02 does. `furuta run` compares name, counts and command limit with the rig file given to it.
#ifndef CONFIG_H
#define CONFIG_H

#include <stdint.h>

// Two ways to wire a driver (docs/arduino.md).
#define TWO_PWM 1            // one input for each end of the motor: DRV8871, BTS7960, L298N
#define PWM_AND_DIRECTION 2  // one PWM input, direction on another pin: MD10C

#ifndef DRIVE
#define DRIVE TWO_PWM
#endif

#define RIG_NAME "shahzad2022-srv02"  // 1 to 32 bytes

// Counts per turn: four times the lines of the encoder, times the gear between encoder and axis. Negative where the
// encoder counts the wrong way.
constexpr int32_t ARM_COUNTS = 4096;
constexpr int32_t PENDULUM_COUNTS = 4096;

constexpr float SUPPLY = 12.0f;         // V at the driver's motor supply: what full PWM gives the motor
constexpr float COMMAND_LIMIT = 10.0f;  // V, the largest voltage that the motor gets

// Beyond these the motor is off. 0: no limit.
constexpr float ARM_ANGLE_LIMIT = 3.0f;        // rad, either way
constexpr float ARM_SPEED_LIMIT = 0.0f;        // rad/s
constexpr float PENDULUM_SPEED_LIMIT = 40.0f;  // rad/s

constexpr uint8_t PERIOD_MS = 2;          // sampling period: 500 Hz
constexpr uint8_t WATCHDOG_PERIODS = 10;  // without a valid command; then the motor is off

constexpr uint32_t BAUD = 500000;  // furuta run --baud 500000; the clock of 16 MHz makes it exactly

#endif
