/* The rig that the board under test drives: the Furuta pendulum's equations of motion (DESIGN.md names where they are
 * derived), written apart from the crate furuta-model, in C and double precision. */
#ifndef PLANT_H
#define PLANT_H

#include <stdbool.h>

typedef struct {
    double theta, alpha, theta_dot, alpha_dot; /* rad, rad/s; alpha 0 upright */
} plant_state;

/* On by `seconds` with `volts` at the motor's terminals. `open`: the driver is off, no current flows. */
void plant_step(plant_state *x, double volts, bool open, double seconds);

#endif
