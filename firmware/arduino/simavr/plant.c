#include "plant.h"

#include <math.h>

/* Quanser SRV02 with its pendulum: the numbers of crates/furuta-model/rigs/shahzad2022-srv02.toml, SI units. */
static const double ARM_LENGTH = 0.158, ARM_INERTIA = 0.0035842, ARM_VISCOUS = 0.004;
static const double MASS = 0.125, COM = 0.1675, GRAVITY = 9.81;
static const double RESISTANCE = 2.6, TORQUE_CONSTANT = 0.007683, BACK_EMF = 0.0076779, GEAR = 70.0, EFFICIENCY = 0.621;

static plant_state rate(plant_state x, double volts, bool open) {
    double s = sin(x.alpha), c = cos(x.alpha);
    /* Mass matrix: a point mass at COM on the arm's end. */
    double m11 = ARM_INERTIA + MASS * (ARM_LENGTH * ARM_LENGTH + COM * COM * s * s);
    double m12 = -MASS * ARM_LENGTH * COM * c;
    double m22 = MASS * COM * COM;
    double current = open ? 0 : (volts - BACK_EMF * GEAR * x.theta_dot) / RESISTANCE;
    double arm = EFFICIENCY * GEAR * TORQUE_CONSTANT * current - ARM_VISCOUS * x.theta_dot -
                 2 * MASS * COM * COM * s * c * x.theta_dot * x.alpha_dot -
                 MASS * ARM_LENGTH * COM * s * x.alpha_dot * x.alpha_dot;
    double pendulum = MASS * COM * COM * s * c * x.theta_dot * x.theta_dot + MASS * GRAVITY * COM * s;
    double det = m11 * m22 - m12 * m12;
    return (plant_state){x.theta_dot, x.alpha_dot, (m22 * arm - m12 * pendulum) / det,
                         (m11 * pendulum - m12 * arm) / det};
}

static plant_state along(plant_state x, plant_state d, double h) {
    return (plant_state){x.theta + h * d.theta, x.alpha + h * d.alpha, x.theta_dot + h * d.theta_dot,
                         x.alpha_dot + h * d.alpha_dot};
}

/* Runge-Kutta, fourth order. */
void plant_step(plant_state *x, double volts, bool open, double h) {
    plant_state a = rate(*x, volts, open);
    plant_state b = rate(along(*x, a, h / 2), volts, open);
    plant_state c = rate(along(*x, b, h / 2), volts, open);
    plant_state d = rate(along(*x, c, h), volts, open);
    *x = along(along(along(along(*x, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
}
