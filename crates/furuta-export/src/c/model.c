
/* The rig's model; states are theta, alpha, theta_dot, alpha_dot. dx/dt under `volts` at the motor; `weight` in place of the model's; `smooth`: with the effects alone that have a
   slope at rest. */
static void rate_of(const furuta_real x[4], furuta_real volts, furuta_real weight, int smooth, furuta_real rate[4])
{
    const furuta_real *const c = FURUTA_MODEL;
    furuta_real s, co, k, kt, twist, torque[2], free0, free1, over, arm, coupling, inverse[3];
    sincos_of(x[1], &s, &co);
    k = c[SWING] * (s * co);
    kt = k * x[2];
    twist = kt * x[3];
    torque[0] = c[DRIVE] * volts - c[ARM_DAMPING] * x[2];
    torque[1] = -(c[PENDULUM_DAMPING] * x[3]);
    add_effects(x, s, co, volts, smooth, torque);
    free0 = torque[0] - (twist + twist + c[COUPLING] * s * (x[3] * x[3])) - ZERO;
    free1 = torque[1] - -(kt * x[2]) - -(weight * s);
    arm = c[ARM] + c[SWING] * (s * s);
    coupling = -(c[COUPLING] * co);
    over = ONE / (arm * c[PENDULUM] - coupling * coupling);
    inverse[0] = c[PENDULUM] * over;
    inverse[1] = -(coupling * over);
    inverse[2] = arm * over;
    rate[0] = x[2];
    rate[1] = x[3];
    rate[2] = inverse[0] * free0 + inverse[1] * free1;
    rate[3] = inverse[1] * free0 + inverse[2] * free1;
}
