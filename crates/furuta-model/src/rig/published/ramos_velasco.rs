//! L. E. Ramos-Velasco, J. J. Ruiz-Leon, S. Celikovsky, *Rotary inverted pendulum: trajectory tracking via nonlinear
//! control techniques* (received 2001). The paper's `beta` is our `-alpha`, its `alpha` our `theta`.

use super::Quantity::{NotReproducible, SteadyArmAngle, SteadyArmSpeed};
use super::{Erratum, Figure, Paper, agrees, differs, tabled};

const T1: &str = "Table 1";
const GAIN: &str = "LQR of weights not printed; stabilises as u = -K x";
const LAMBDA: &str = "fits neither lambda = 1 (ours) nor its own 3";
const DAMPING: &str = "from the damping of (39) that lacks d12, d22";
const SIGN: &str = "that damping, and a sign lost at w2^3";

pub(super) const PAPER: Paper = Paper {
    rig: "ramos-velasco",
    note: "The paper's alpha is our theta, its beta our -alpha. Its model is planar, without the sin2 \
        inertia m_2 l_2^2 that the rig has: ours of sec. 4 are of the planar model, lambda = 1.",
    figures: &FIGURES,
    errata: &[
        Erratum {
            place: "Table 1",
            printed: "k_g in cm",
            corrected: "k_g a pure ratio, 5.5",
            reason: "T_1 = k_m k_g / R_m is a torque per volt only then; with 0.055 the published K \
                stabilises in neither sign",
        },
        Erratum {
            place: "sec. 3, motor",
            printed: "tau_1 = T_1 v - T_2 beta'",
            corrected: "tau_1 = T_1 v - T_2 alpha'",
            reason: "the back-EMF belongs to the shaft that the motor turns, the arm; as printed a \
                short-circuited motor gives energy away (tau_1 alpha' > 0 for alpha' and beta' of opposite \
                sign)",
        },
        Erratum {
            place: "(39)",
            printed: "f_31 = ((T_2 + c_12) x_4 - d_12 g_2) / p, f_41 = (d_11 g_2 - (T_2 + c_12) x_4) / p",
            corrected: "f_31 = (d_22 (T_2 + c_12) x_4 - d_12 g_2) / p, f_41 = (d_11 g_2 - d_12 (T_2 + c_12) x_4) / p",
            reason: "solving (38) for the accelerations: the arm's torque reaches them through d_22 and \
                d_12, as it does in g_31 and g_41; as printed the published K stabilises in neither sign",
        },
        Erratum {
            place: "sec. 4.2",
            printed: "f_41 = -((T_2 + c_12) beta' + d_11 g_2) / p",
            corrected: "f_41 = (d_11 g_2 - d_12 (T_2 + c_12) beta') / p",
            reason: "(38) solved for beta''; (39) has the sign of d_11 g_2 right; with that of sec. 4.2 \
                gravity would right a leaning pendulum",
        },
        Erratum {
            place: "sec. 4.1, control law",
            printed: "u = c(w) + K (x - pi(w))",
            corrected: "u = c(w) - K (x - pi(w))",
            reason: "with the K of sec. 5; with a plus the linear closed loop has a pole at +38.9",
        },
        Erratum {
            place: "sec. 4.1, pi",
            printed: "pi_1 = -15.33 w2 ..., pi_2 = 45.99 w1 ... for lambda = 1",
            corrected: "pi_1 = -81.23 w2 ..., pi_2 = 81.23 w1 ...",
            reason: "pi_2 = d pi_1 / dt makes their ratio lambda, here 3; and the terms of second order \
                cannot have derivatives of third order",
        },
        Erratum {
            place: "(46), (53)",
            printed: "z_2' = f_41 + g_41 u",
            corrected: "z_2' = f_41 + g_41 u + lambda^2 w2",
            reason: "z_2 = beta' + lambda w1 is the rate of beta - w2; sec. 4.1 has the term, c(w) = -(w2 \
                + f_41) / g_41 for lambda = 1, and without it (53) asks for another acceleration than the \
                reference's",
        },
        Erratum {
            place: "sec. 4.2, pi_eta",
            printed: "530.92 w1 - 147.97 w1^3 + 73.80 w1^2 w2 - 221.95 w1 w2^2 + 58.55 w2^3 beside -81.23 w2",
            corrected: "-81.23 w2 - 18.69 w1^2 w2 - 21.81 w2^3",
            reason: "530.92, -147.97 and -221.95 solve the zero dynamics of (39) as printed, whose damping \
                lacks d_12 and d_22; 73.80 and 58.55 do so with the sign of its w2^3 term turned round \
                (with the right one, 36.42 and 14.93); without that damping none of them remains",
        },
    ],
};

const FIGURES: [Figure; 29] = [
    tabled(T1, "m_2", 0.55, "pendulum.mass"),
    tabled(T1, "l_1", 0.13, "arm.length"),
    tabled(T1, "l_2", 0.75, "pendulum.com"),
    tabled(T1, "J", 0.005, "arm.inertia"),
    tabled(T1, "g", 9.81, "environment.gravity"),
    tabled(T1, "k_g", 5.5, "motor.gear_ratio").remark("printed in cm; a pure ratio"),
    tabled(T1, "k_m", 0.104, "motor.torque_constant"),
    tabled(T1, "R_m", 1.9, "motor.resistance"),
    differs("sec. 5", "K[alpha]", -0.66, NotReproducible, GAIN),
    differs("sec. 5", "K[beta]", -43.25, NotReproducible, GAIN),
    differs("sec. 5", "K[alpha']", -1.33, NotReproducible, GAIN),
    differs("sec. 5", "K[beta']", -13.5, NotReproducible, GAIN),
    differs("sec. 4.1", "pi_1 w2", -15.33, SteadyArmAngle(0, 1), LAMBDA),
    differs(
        "sec. 4.1",
        "pi_1 w1 w2",
        -4.31,
        SteadyArmAngle(1, 1),
        "of second order: meant is w1^2 w2?",
    ),
    differs(
        "sec. 4.1",
        "pi_1 w2^2",
        -4.78,
        SteadyArmAngle(0, 2),
        "of second order: meant is w2^3?",
    ),
    differs("sec. 4.1", "pi_2 w1", 45.99, SteadyArmSpeed(1, 0), LAMBDA),
    differs("sec. 4.1", "pi_2 w1^3", 12.3, SteadyArmSpeed(3, 0), LAMBDA),
    differs(
        "sec. 4.1",
        "pi_2 w1 w2^2",
        18.0,
        SteadyArmSpeed(1, 2),
        LAMBDA,
    ),
    differs(
        "sec. 4.2",
        "pi_eta1 w1",
        530.92,
        SteadyArmAngle(1, 0),
        DAMPING,
    ),
    agrees(
        "sec. 4.2",
        "pi_eta1 w2",
        -81.23,
        SteadyArmAngle(0, 1),
        0.005,
    ),
    differs(
        "sec. 4.2",
        "pi_eta1 w1^3",
        -147.97,
        SteadyArmAngle(3, 0),
        DAMPING,
    ),
    differs(
        "sec. 4.2",
        "pi_eta1 w1^2 w2",
        73.80,
        SteadyArmAngle(2, 1),
        SIGN,
    ),
    differs(
        "sec. 4.2",
        "pi_eta1 w1 w2^2",
        -221.95,
        SteadyArmAngle(1, 2),
        DAMPING,
    ),
    differs(
        "sec. 4.2",
        "pi_eta1 w2^3",
        58.55,
        SteadyArmAngle(0, 3),
        SIGN,
    ),
    agrees("sec. 4.2", "pi_eta2 w1", 81.23, SteadyArmSpeed(1, 0), 0.005),
    differs(
        "sec. 4.2",
        "pi_eta2 w2",
        530.92,
        SteadyArmSpeed(0, 1),
        DAMPING,
    ),
    differs(
        "sec. 4.2",
        "pi_eta2 w1^3",
        -73.80,
        SteadyArmSpeed(3, 0),
        SIGN,
    ),
    agrees(
        "sec. 4.2",
        "pi_eta2 w1 w2^2",
        28.04,
        SteadyArmSpeed(1, 2),
        0.005,
    ),
    differs(
        "sec. 4.2",
        "pi_eta2 w2^3",
        -221.95,
        SteadyArmSpeed(0, 3),
        DAMPING,
    ),
];
