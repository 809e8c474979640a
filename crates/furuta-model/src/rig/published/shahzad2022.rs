//! A. Shahzad, S. Munshi, S. Azam, M. N. Khan, *Design and implementation of a state-feedback controller using LQR
//! technique* (2022).

use super::Quantity::{ArmResolution, IdentityGain, InputMatrix, Parameter, StateMatrix};
use super::{Erratum, Figure, Paper, agrees, tabled};

const T2: &str = "Table 2";
/// Half a unit of the last of the two printed decimals.
const ROUNDING: f64 = 0.005;
const WEIGHTS: &str = "weights not printed; Q = I, R = 1 gives every digit";

pub(super) const PAPER: Paper = Paper {
    rig: "shahzad2022-srv02",
    note: "The paper orders its state theta, theta_dot, alpha, alpha_dot; entries are named here, so the \
        order does not matter.",
    figures: &FIGURES,
    errata: &[
        Erratum {
            place: "(3) to (5)",
            printed: "z = -L cos(alpha)",
            corrected: "z = L cos(alpha)",
            reason: "the potential energy (1), m g L cos(alpha), is largest upright, and (6) has the rate \
                -L sin(alpha) alpha'; the speed squared does not show it",
        },
        Erratum {
            place: "(5)",
            printed: "y = r sin(theta) + L cos(theta) sin(alpha)",
            corrected: "y = r sin(theta) - L cos(theta) sin(alpha)",
            reason: "(3) and (4) give the minus, and only with it does the speed squared become (9), on \
                which all that follows rests",
        },
        Erratum {
            place: "(6), (7)",
            printed: "y' = -r cos(theta) theta' + ...",
            corrected: "y' = r cos(theta) theta' + ...",
            reason: "the derivative of the corrected (5); only with the plus does (8) follow from (7)",
        },
        Erratum {
            place: "(32)",
            printed: "r g cos(alpha) sin(2 alpha) / 2",
            corrected: "r g sin(2 alpha) / 2",
            reason: "(30), from which (32) is rewritten, has r g cos(alpha) sin(alpha)",
        },
        Erratum {
            place: "(33)",
            printed: "r cos(alpha) / (L sin2(alpha) (L2 + r2) + J_eq / m)",
            corrected: "r cos(alpha) / (L [sin2(alpha) (L2 + r2) + J_eq / m])",
            reason: "(31), from which (33) is rewritten, has the bracket, as have (50) and the linear (62)",
        },
        Erratum {
            place: "(52)",
            printed: "(p) - (q) x [...]",
            corrected: "((p) - (q)) x [...]",
            reason: "p and q are the two terms of one derivative, by which the whole bracket is \
                multiplied; at the upright equilibrium p = q = [...] = 0, and (53) is right",
        },
        Erratum {
            place: "(61)",
            printed: "... U - [0, a, 0, b] theta'",
            corrected: "... U + [0, a, 0, b] theta'",
            reason: "the a and b given below it are negative already, and (62) and (A) have them as they are; as \
                printed the damping would drive the arm",
        },
    ],
};

const FIGURES: [Figure; 21] = [
    tabled(T2, "L", 0.1675, "pendulum.com"),
    tabled(T2, "m", 0.125, "pendulum.mass"),
    tabled(T2, "r", 0.158, "arm.length"),
    tabled(T2, "J_eq", 0.0035842, "arm.inertia"),
    tabled(T2, "B_eq", 0.004, "arm.viscous"),
    agrees(
        T2,
        "eta_g eta_m",
        0.9 * 0.69,
        Parameter("motor.efficiency"),
        1e-15,
    )
    .remark("printed apart, 0.9 and 0.69"),
    tabled(T2, "R_m", 2.6, "motor.resistance"),
    tabled(T2, "K_t", 0.007683, "motor.torque_constant"),
    tabled(T2, "K_g", 70.0, "motor.gear_ratio"),
    tabled(T2, "K_m", 0.0076779, "motor.back_emf_constant"),
    agrees(T2, "K_enc", 0.001534, ArmResolution, 5e-7).remark("2 pi / 4096"),
    agrees(
        "(A)",
        "A[theta_dot, theta_dot]",
        -20.38,
        StateMatrix(2, 2),
        ROUNDING,
    ),
    agrees(
        "(A)",
        "A[theta_dot, alpha]",
        54.06,
        StateMatrix(2, 1),
        ROUNDING,
    ),
    agrees(
        "(A)",
        "A[alpha_dot, theta_dot]",
        -19.22,
        StateMatrix(3, 2),
        ROUNDING,
    ),
    agrees(
        "(A)",
        "A[alpha_dot, alpha]",
        109.56,
        StateMatrix(3, 1),
        ROUNDING,
    ),
    agrees("(B)", "B[theta_dot]", 35.84, InputMatrix(2), ROUNDING),
    agrees("(B)", "B[alpha_dot]", 33.81, InputMatrix(3), ROUNDING),
    agrees("(C)", "K[theta]", -1.0, IdentityGain(0), ROUNDING).remark(WEIGHTS),
    agrees("(C)", "K[theta_dot]", -2.02, IdentityGain(2), ROUNDING).remark(WEIGHTS),
    agrees("(C)", "K[alpha]", 27.68, IdentityGain(1), ROUNDING).remark(WEIGHTS),
    agrees("(C)", "K[alpha_dot]", 3.56, IdentityGain(3), ROUNDING).remark(WEIGHTS),
];
