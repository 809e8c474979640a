"""Gains of the sampled LQR about steady rotation by SciPy: the answers in scheduled_lqr.rs.

furuta.linearize gives the model at the speed itself. Run: python scheduled_lqr.py > scheduled_lqr.rs
"""

import furuta
import numpy as np
import scipy
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

Q, RATE = np.diag([1 / 16, 4.0, 0.0, 0.0]), 500.0


def gain(rig, speed):
    r = np.array([[1 / rig.parameters["motor.command_limit"] ** 2]])
    a, b = furuta.linearize(rig, [0.0, 0.0, speed, 0.0])
    a, b, *_ = cont2discrete((a, b, np.eye(4), np.zeros((4, 1))), 1 / RATE)
    s = solve_discrete_are(a, b, Q, r)
    return np.linalg.solve(r + b.T @ s @ b, b.T @ s @ a)[0]


print(f"// Made by scheduled_lqr.py with SciPy {scipy.__version__} and NumPy {np.__version__}; do not edit.")
print("/// Rig, speed of the arm (rad/s), gain; Q = diag(1/16, 4, 0, 0), R = 1/limit^2, 500 Hz.")
print("#[rustfmt::skip]")
print("pub(crate) const GAINS: [(&str, f64, [f64; 4]); 12] = [")
for name in furuta.Rig.BUILTIN:
    for speed in [0.0, 6.0, 12.0]:
        row = ", ".join(repr(float(k)) for k in gain(furuta.Rig.load(name), speed))
        print(f'    ("{name}", {speed}, [{row}]),')
print("];")
