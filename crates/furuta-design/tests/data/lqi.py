"""Gains of sampled LQIs by SciPy: the answers in lqi.rs.

The integral of the arm's angle is a state of the continuous system; cont2discrete samples all five with the command
held, solve_discrete_are gives the gain. Run: python lqi.py > lqi.rs
"""

import furuta
import numpy as np
import scipy
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

Q, R = np.diag([5.0, 1.0, 0.1, 0.1, 20.0]), np.array([[0.1]])


def gain(name, rate):
    a, b = furuta.linearize(furuta.Rig.load(name))
    a = np.block([[a, np.zeros((4, 1))], [np.eye(1, 5)]])
    b = np.vstack([b, [[0.0]]])
    a, b, *_ = cont2discrete((a, b, np.eye(5), np.zeros((5, 1))), 1 / rate)
    s = solve_discrete_are(a, b, Q, R)
    return np.linalg.solve(R + b.T @ s @ b, b.T @ s @ a)[0]


print(f"// Made by lqi.py with SciPy {scipy.__version__} and NumPy {np.__version__}; do not edit.")
print("/// Rig, samples per second, gain on the states and the integral.")
print("#[rustfmt::skip]")
print("pub(crate) const GAINS: [(&str, f64, [f64; 5]); 12] = [")
for name in furuta.Rig.BUILTIN:
    for rate in [500.0, 100.0, 50.0]:
        print(f'    ("{name}", {rate}, [{", ".join(repr(float(k)) for k in gain(name, rate))}]),')
print("];")
