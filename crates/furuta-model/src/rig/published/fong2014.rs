//! T. Teng Fong, Z. Jamaludin, L. Abdullah, *System identification and modelling of rotary inverted pendulum* (2014).

use super::Quantity::{
    ArmCounts, HangingDenominator, HangingNumerator, InputMatrix, Parameter, StateMatrix,
};
use super::{Erratum, Figure, Paper, agrees, differs, tabled};

const T1: &str = "Table 1";

/// Why the paper's fit (29) is not our (28): it is fitted to measurements.
const FITTED: &str = "fitted to measurements, not derived: shows what (28) is missing";

pub(super) const PAPER: Paper = Paper {
    rig: "fong2014-emecs",
    note: "Ours beside (29) is (28), alpha(s) / u(s) hanging: its numbers are not in the text we have, \
        they follow from Table 1.",
    figures: &FIGURES,
    errata: &[Erratum {
        place: "Table 1",
        printed: "C_2 = 390 kg m2/s",
        corrected: "C_2 = 3.167e-4 kg m2/s",
        reason: "solving either entry of (24) with C_2 for it gives 3.167e-4 (-0.1098) and 3.168e-4 \
            (-1.0584); 390 gives -135208 and -1302999, and with the exponent lost, 3.9e-4, -0.1352 and \
            -1.3030",
    }],
};

const FIGURES: [Figure; 29] = [
    tabled(T1, "m_2", 0.022, "pendulum.mass"),
    tabled(T1, "l_1", 0.16, "arm.length"),
    tabled(T1, "c_2", 0.08, "pendulum.com"),
    tabled(T1, "J_1", 0.00215058, "arm.inertia"),
    tabled(T1, "J_2", 0.00018773, "pendulum.inertia"),
    tabled(T1, "C_1", 0.02, "arm.viscous"),
    differs(
        T1,
        "C_2",
        390.0,
        Parameter("pendulum.viscous"),
        "misprint: 3.167e-4 gives both entries of (24) with C_2",
    ),
    tabled(T1, "g", 9.8, "environment.gravity"),
    tabled(T1, "K_t", 0.01826, "motor.torque_constant"),
    tabled(T1, "K_b", 0.01826, "motor.back_emf_constant"),
    tabled(T1, "K_u", 10.0, "motor.amplifier_gain"),
    tabled(T1, "R_m", 2.5604, "motor.resistance"),
    differs(
        "sec. II",
        "encoder counts",
        500.0,
        ArmCounts,
        "taken as 500 lines, counted four times in quadrature",
    ),
    // One or two units of the last printed digit: Table 1 is rounded, and the paper cut off rather than rounded.
    agrees(
        "(24)",
        "A[theta_dot, alpha]",
        5.9796,
        StateMatrix(2, 1),
        1e-4,
    ),
    agrees(
        "(24)",
        "A[theta_dot, theta_dot]",
        -8.1419,
        StateMatrix(2, 2),
        1e-4,
    ),
    agrees(
        "(24)",
        "A[theta_dot, alpha_dot]",
        -0.1098,
        StateMatrix(2, 3),
        1e-4,
    )
    .remark("C_2 corrected"),
    agrees(
        "(24)",
        "A[alpha_dot, alpha]",
        57.6254,
        StateMatrix(3, 1),
        1e-3,
    ),
    agrees(
        "(24)",
        "A[alpha_dot, theta_dot]",
        -6.9788,
        StateMatrix(3, 2),
        1e-4,
    ),
    agrees(
        "(24)",
        "A[alpha_dot, alpha_dot]",
        -1.0584,
        StateMatrix(3, 3),
        5e-4,
    )
    .remark("C_2 corrected"),
    agrees("(24)", "B[theta_dot]", 28.8442, InputMatrix(2), 1.5e-3),
    agrees("(24)", "B[alpha_dot]", 24.7236, InputMatrix(3), 1.5e-3),
    differs("(29)", "numerator s^3", 0.0277, HangingNumerator(3), FITTED),
    agrees("(29)", "numerator s^2", -24.92, HangingNumerator(2), 0.25)
        .remark("fit and (28) agree here, to 1 %"),
    differs("(29)", "numerator s", -323.4, HangingNumerator(1), FITTED),
    differs("(29)", "numerator 1", 164.6, HangingNumerator(0), FITTED),
    differs(
        "(29)",
        "denominator s^3",
        15.28,
        HangingDenominator(3),
        FITTED,
    ),
    differs(
        "(29)",
        "denominator s^2",
        200.6,
        HangingDenominator(2),
        FITTED,
    ),
    differs(
        "(29)",
        "denominator s",
        1589.0,
        HangingDenominator(1),
        FITTED,
    ),
    differs(
        "(29)",
        "denominator 1",
        6548.0,
        HangingDenominator(0),
        "not 0: on the rig something pulls the arm back",
    ),
];
