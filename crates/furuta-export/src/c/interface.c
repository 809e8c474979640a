/* Modes and faults, as docs/controllers.md has them. */
typedef enum {
    FURUTA_IDLE, FURUTA_SWING_UP, FURUTA_BALANCE, FURUTA_STOPPING, FURUTA_BRAKING, FURUTA_FAULT
} furuta_mode;
typedef enum {
    FURUTA_SOUND, FURUTA_NOT_A_NUMBER, FURUTA_ARM_ANGLE, FURUTA_ARM_SPEED, FURUTA_PENDULUM_SPEED
} furuta_fault;
typedef enum { FURUTA_START, FURUTA_STOP, FURUTA_RESET } furuta_request;

/* A controller's memory. Make it `static`; furuta_init fills it. `mode`, `fault`, `now` (the estimated theta, alpha,
   theta_dot, alpha_dot) and `reference` (where the arm is asked to be, rad) may be read; nothing is to be written. */
typedef struct {
    furuta_mode mode;
    furuta_fault fault;
    furuta_real now[4];
    furuta_real reference;
    /* The last command, V. */
    furuta_real u;
    /* Estimator: the state believed, what the motor holds, what acts beside it; angles and two low passes. */
    furuta_real belief[4], held, disturbance, angle[2], first[2], second[2];
    int started, seen[2];
    /* Balance controller: what it has learnt; of the sample before the arm's angle and speed, and where it was wanted. */
    furuta_real memory, before[3];
    int has_before;
    /* Swing-up. */
    furuta_real direction, waited, heavier;
    furuta_real energy, cosine, theta_dot, lost, risen;
    uint32_t strokes;
    int ascent;
    /* Supervisor. */
    furuta_real arm_reference, bump, catch_jump, resting;
    int has_bump, has_catch_jump;
    uint32_t since_test, braking_left;
    furuta_real braking_from, braking_u;
} furuta_controller;

/* Idle, before the first sample. */
void furuta_init(furuta_controller *f);

/* Asks for a change of mode; 0 where it makes no sense in the present one. */
int furuta_ask(furuta_controller *f, furuta_request request);

/* One sample. theta (rad): arm; alpha (rad): pendulum, 0 upright, positive as the model says (near upright a positive
   acceleration of the arm tips it towards positive alpha); held (V): the command that the motor holds from this sample
   to the next, in a loop with one sample of delay the answer of the call before (f->u); periods: sample periods since
   the sample before, 1 where none was lost; target (rad): where the arm is to go once the pendulum is up. The answer:
   the command, V, always finite and within the limit; 0 in the modes idle, stopping and fault. */
furuta_real furuta_step(furuta_controller *f, furuta_real theta, furuta_real alpha, furuta_real held,
                        uint32_t periods, furuta_real target);
