"""Does an unscented or a moving-horizon estimator earn its place beside the extended Kalman filter?

All watch the same runs, with the same noises and the same model (furuta's own plant, stiction and all): balanced with a
limit cycle of dry friction, arm steps with friction, and an arm whose zero is off under a cable that the rig file
knows. Run: python py/tests/unscented.py [RIG ...] [--seconds S]. It prints the table of docs/estimators.md.
"""

import argparse

import furuta
import numpy as np

RATE = 500.0
H = 1.0 / RATE
SETTLING = 0.25
HORIZON = 20
# Dry friction of the arm that would be noticed (N m), as `furuta study limit-cycle` takes it.
FRICTION = {"shahzad2022-srv02": 0.0642269, "qube-servo-2": 0.0025}


class Model:
    """The plant of a rig file and the noises of furuta's Kalman filters."""

    def __init__(self, rig):
        self.sim = furuta.Simulator(rig, np.zeros(4), H)
        self.limit = rig.parameters["motor.command_limit"]
        mass, com = self.of(rig, "pendulum.mass"), self.of(rig, "pendulum.com")
        inertia = self.of(rig, "pendulum.inertia") + mass * com**2
        frequency = np.sqrt(mass * self.of(rig, "environment.gravity") * com / inertia)
        counts = [rig.sensors["arm_counts_per_rev"], rig.sensors["pendulum_counts_per_rev"]]
        self.command = 0.05 * self.limit
        self.pendulum = 0.05 * frequency**2
        self.reading = 2 * np.pi / np.array(counts) / np.sqrt(12)
        self.start = np.diag(np.r_[self.reading**2, np.full(2, (3 * frequency) ** 2)])
        # A push on the pendulum over a sample, as the extended filter has it.
        self.push = np.array([0.0, 0.5 * H * H, 0.0, H]) * self.pendulum
        self.count = 0

    @staticmethod
    def of(rig, key):
        return rig.parameters[key]

    def step(self, x, u):
        self.count += 1
        self.sim.reset(x)
        self.sim.step(u)
        return self.sim.x


class Unscented:
    """Wan and van der Merwe's filter (2000), alpha = 1, kappa = 0, beta = 2; noise in the command goes through the
    model as a fifth direction. The measurement is linear, so it corrects as in a Kalman filter."""

    def __init__(self, model, zero=0.0):
        self.m, self.x, self.p = model, None, None
        # Variance of the arm's zero at the start, rad^2: a state of its own where it is not 0.
        self.zero = zero

    def update(self, y, held):
        m = self.m
        n = 5 if self.zero else 4
        if self.x is None:
            self.x = np.zeros(n)
            self.x[:2] = y
            self.p = np.zeros((n, n))
            self.p[:4, :4] = m.start
            if self.zero:
                self.p[4, 4] = self.zero
        else:
            size = n + 1
            root = np.zeros((size, size))
            root[:n, :n] = np.linalg.cholesky(self.p + 1e-18 * np.eye(n))
            root[n, n] = m.command
            root *= np.sqrt(size)
            points = np.array([np.r_[self.x, 0.0] + s for s in np.vstack([np.zeros(size), root.T, -root.T])])
            moved = np.array([np.r_[m.step(p[:4], self.held + p[n]), p[4:n]] for p in points])
            mean_weight = np.r_[0.0, np.full(2 * size, 0.5 / size)]
            weight = np.r_[2.0, np.full(2 * size, 0.5 / size)]  # 1 - alpha^2 + beta at the middle
            self.x = mean_weight @ moved
            off = moved - self.x
            push = np.r_[m.push, np.zeros(n - 4)]
            self.p = off.T @ (weight[:, None] * off) + np.outer(push, push)
        c = np.eye(2, n)
        if self.zero:
            c[0, 4] = 1.0
        gain = self.p @ c.T @ np.linalg.inv(c @ self.p @ c.T + np.diag(m.reading**2))
        self.x = self.x + gain @ (y - c @ self.x)
        joseph = np.eye(n) - gain @ c
        self.p = joseph @ self.p @ joseph.T + gain @ np.diag(m.reading**2) @ gain.T
        self.held = held
        return self.x[:4]


class MovingHorizon:
    """Rao, Rawlings and Lee (2001): the state at the start of the last HORIZON samples and the command's noise in each,
    by Gauss-Newton steps on the plant itself, warm-started; the arrival cost is the covariance carried along the
    trajectory. With `zero` the arm's zero is a further unknown, constant over the window, carried with the arrival."""

    def __init__(self, model, zero=0.0, iterations=1):
        self.m, self.iterations, self.zero = model, iterations, zero
        self.n = 5 if zero else 4
        self.ys, self.us, self.ws = [], [], []
        self.x0 = self.p0 = None

    def linear(self, x, u):
        """Where one step leads, and its derivatives by state and command."""
        y = np.r_[self.m.step(x[:4], u), x[4:]]
        f = np.eye(self.n)
        steps = np.r_[1e-5, 1e-5, 1e-4, 1e-4]
        for i, d in enumerate(steps):
            there = x[:4].copy()
            there[i] += d
            f[:4, i] = (self.m.step(there, u) - y[:4]) / d
        g = np.zeros(self.n)
        g[:4] = (self.m.step(x[:4], u + 1e-3) - y[:4]) / 1e-3
        return y, f, g

    def update(self, y, held):
        m, n = self.m, self.n
        if self.x0 is None:
            self.x0 = np.r_[y, np.zeros(n - 2)]
            self.prior = self.x0.copy()
            self.p0 = np.zeros((n, n))
            self.p0[:4, :4] = m.start
            if self.zero:
                self.p0[4, 4] = self.zero
        self.ys.append(y)
        self.us.append(held)
        c = np.eye(2, n)
        if self.zero:
            c[0, 4] = 1.0
        k = len(self.ys)
        for _ in range(self.iterations):
            unknowns = n + k - 1
            rows, rest = [], []
            # The arrival cost.
            inverse = np.linalg.inv(np.linalg.cholesky(self.p0 + 1e-16 * np.eye(n)))
            rows.append(np.hstack([inverse, np.zeros((n, k - 1))]))
            rest.append(inverse @ (self.prior - self.x0))
            x, s = self.x0, np.hstack([np.eye(n), np.zeros((n, k - 1))])
            trajectory, steps = [x], []
            for i in range(k):
                rows.append((c @ s) / m.reading[:, None])
                rest.append((self.ys[i] - c @ x) / m.reading)
                if i < k - 1:
                    x, f, g = self.linear(x, self.us[i] + self.ws[i])
                    s = f @ s
                    s[:, n + i] += g
                    row = np.zeros((1, unknowns))
                    row[0, n + i] = 1 / m.command
                    rows.append(row)
                    rest.append([-self.ws[i] / m.command])
                    trajectory.append(x)
                    steps.append((f, g))
            change = np.linalg.lstsq(np.vstack(rows), np.concatenate(rest), rcond=None)[0]
            self.x0 = self.x0 + change[:n]
            self.ws = [w + d for w, d in zip(self.ws, change[n:], strict=True)]
            x = x + s @ change
        if k == HORIZON:
            f, g = steps[0]
            gain = self.p0 @ c.T @ np.linalg.inv(c @ self.p0 @ c.T + np.diag(m.reading**2))
            joseph = np.eye(n) - gain @ c
            p = joseph @ self.p0 @ joseph.T + gain @ np.diag(m.reading**2) @ gain.T
            push = np.r_[m.push, np.zeros(n - 4)]
            self.p0 = f @ p @ f.T + m.command**2 * np.outer(g, g) + np.outer(push, push)
            # Filtered, not smoothed: the arrival counts no reading twice.
            filtered = self.prior + gain @ (self.ys[0] - c @ self.prior)
            self.prior = np.r_[m.step(filtered[:4], self.us[0]), filtered[4:]]
            self.x0 = np.r_[m.step(self.x0[:4], self.us[0] + self.ws[0]), self.x0[4:]]
            self.ys.pop(0)
            self.us.pop(0)
            self.ws.pop(0)
        self.ws.append(0.0)
        return x[:4]


def record(known, real, seconds, target, zero):
    """Balanced by the standard control system for the rig `known`: true states, readings (the arm's off by `zero`),
    commands held."""
    system = furuta.Supervisor(known, dt=H)
    sim = furuta.Simulator(real, [0.0, 0.03, 0.0, 0.0], H)
    xs, ys, us, held = [], [], [], 0.0
    for k in range(int(seconds * RATE)):
        y = sim.reading
        xs.append(sim.x)
        ys.append(y + [zero, 0.0])
        us.append(held)
        u, _ = system.step(k * H, y[0], y[1], target=target(k * H))
        sim.step(held)
        held = u
    return np.array(xs), np.array(ys), np.array(us)


def errors(said, xs):
    skip = int(SETTLING * RATE)
    return np.sqrt(np.mean((said[skip:, 2:] - xs[skip:, 2:]) ** 2, axis=0))


def watch(estimator, ys, us):
    return np.array([estimator.update(y, u) for y, u in zip(ys, us, strict=True)])


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("rigs", nargs="*", default=list(FRICTION), help=f"of {', '.join(FRICTION)}")
    arguments.add_argument("--seconds", type=float, default=6.0)
    given = arguments.parse_args()
    for name in given.rigs:
        rig = furuta.Rig.load(name)
        dry = FRICTION[name]
        stuck = rig.with_effect("arm.coulomb", torque=dry)
        cable = rig.with_effect("arm.spring", stiffness=2 * dry, rest=0.0)
        still = lambda t: 0.0  # noqa: E731
        steps = lambda t: 0.3 if int(t / 2) % 2 == 0 else -0.3  # noqa: E731
        cases = [
            ("limit cycle, friction not in the file", stuck, rig, still, 0.0, 0.0),
            ("limit cycle, friction in the file", stuck, stuck, still, 0.0, 0.0),
            ("arm steps, friction in the file", stuck, stuck, steps, 0.0, 0.0),
            ("cable, the arm's zero off by 0.1 rad", cable, cable, steps, 0.1, 0.01),
        ]
        print(f"{name} at {RATE:g} Hz, {given.seconds:g} s; RMS errors of the speeds [rad/s]")
        print(f"  {'run':40} {'estimator':24} {'arm':>8} {'pendulum':>9} {'plant steps':>12}")
        for title, real, known, target, zero, variance in cases:
            # The control system of the limit cycle does not know the friction, or there would be none.
            by = rig if target is still else real
            xs, ys, us = record(by, real, given.seconds, target, zero)
            rows = [("ekf", errors(furuta.Estimator("ekf", known, H).filter(ys[:, 0], ys[:, 1], us), xs), 1.0)]
            kinds = [("unscented", Unscented, 0.0), ("moving horizon", MovingHorizon, 0.0)]
            if variance:
                kinds += [("unscented, zero a state", Unscented, variance)]
                kinds += [("moving horizon, with zero", MovingHorizon, variance)]
            for label, kind, spread in kinds:
                model = Model(known)
                said = watch(kind(model, zero=spread), ys, us)
                rows.append((label, errors(said, xs), model.count / len(us)))
            for label, (arm, pendulum), count in rows:
                print(f"  {title:40} {label:24} {arm:8.4f} {pendulum:9.4f} {count:12.0f}")


if __name__ == "__main__":
    main()
