"""The steady motion of a rotary pendulum that follows alpha = w2, by SymPy: the answers in steady_motion.rs.

Undetermined coefficients on the equations of motion written out again, in rational arithmetic to the end; nothing is
shared with the crate. Run: python steady_motion.py > steady_motion.rs
"""

import sympy as sp

w1, w2, e = sp.symbols("w1 w2 e")
ORDER = 7


def solve(
    length, hub, mass, com, inertia, transverse, axial, arm_viscous, viscous, resistance, kt, km, gravity, lam, swing=1
):
    def truncated(f, order):
        """Terms of degree <= order in (w1, w2); f is a polynomial or a series in sin, cos of w2."""
        return sp.expand(sp.series(sp.expand(f.subs({w1: e * w1, w2: e * w2})), e, 0, order + 1).removeO()).subs(e, 1)

    def rate(p):
        return sp.expand(lam * w2 * sp.diff(p, w1) - lam * w1 * sp.diff(p, w2))

    sin, cos = (sp.series(f(w2), w2, 0, ORDER + 2).removeO() for f in (sp.sin, sp.cos))
    secant = sp.series(1 / sp.cos(w2), w2, 0, ORDER + 2).removeO()
    k = swing * (mass * com**2 + transverse - axial)
    coupling, m22 = mass * length * com, inertia + mass * com**2
    alpha, alpha1, alpha2 = w2, -lam * w1, -(lam**2) * w2
    theta = sp.Integer(0)
    for degree in range(1, ORDER + 1, 2):
        names = sp.symbols(f"a0:{degree + 1}")
        part = sum(a * w1 ** (degree - j) * w2**j for j, a in enumerate(names))
        trial = rate(rate(part))
        # -m L c cos(alpha) theta'' + M22 alpha'' - k sin cos theta'^2 + b_p alpha' - m g c sin(alpha) = 0
        moment = m22 * alpha2 + viscous * alpha1 - mass * gravity * com * sin - k * sin * cos * rate(theta) ** 2
        wanted = truncated(sp.expand(moment * secant / coupling), degree)
        wanted = sum(t for t in sp.Add.make_args(wanted) if sp.Poly(t, w1, w2).total_degree() == degree)
        equations = sp.Poly(trial - wanted, w1, w2).coeffs()
        theta += part.subs(sp.solve(equations, names))
    theta = sp.expand(theta)
    theta1 = rate(theta)
    theta2 = rate(theta1)
    m11 = hub + mass * length**2 + axial + k * sin**2
    torque = m11 * theta2 - coupling * cos * alpha2 + 2 * k * sin * cos * theta1 * alpha1 + coupling * sin * alpha1**2
    torque += (arm_viscous + kt * km / resistance) * theta1
    return theta, truncated(sp.expand(torque * resistance / kt), ORDER)


R = sp.Rational
QUBE = [R(x) for x in "0.085 0.0000618 0.024 0.0645 0.00003328 0.00003328 0 0.0015 0.0005 8.4 0.042 0.042 9.81".split()]
# Motor and gear of Ramos-Velasco: k_m k_g in the place of both constants.
RAMOS = [R(x) for x in "0.13 0.005 0.55 0.75 0 0 0 0 0 1.9 0.572 0.572 9.81".split()]

print("//! Steady motions by SymPy: exponents of w1 and w2, coefficient of the arm's angle (rad), of the command (V).")
print(f"//! Made by steady_motion.py with SymPy {sp.__version__}; do not edit.")
for name, rig, lam, swing in [
    ("QUBE", QUBE, R(3), 1),
    ("RAMOS_VELASCO_PLANAR", RAMOS, R(1), 0),
    ("RAMOS_VELASCO", RAMOS, R(1), 1),
]:
    theta, command = solve(*rig, lam, swing)
    print(f"\npub(crate) const {name}: [(usize, usize, f64, f64); 20] = [")
    for degree in range(1, ORDER + 1, 2):
        for j in range(degree + 1):
            a, c = (sp.Poly(p, w1, w2).coeff_monomial(w1 ** (degree - j) * w2**j) for p in (theta, command))
            print(f"    ({degree - j}, {j}, {float(a)!r}, {float(c)!r}),")
    print("];")
