"""What is refused where it is given, and not where it is used: in Python, numbers that cannot be."""

from __future__ import annotations

import furuta
import numpy as np
import pytest

RIG = furuta.Rig("qube-servo-2")


def test_a_response_has_deviations_and_frequencies_that_can_be():
    lines = [1.0, 2.0]
    for std in ([-1.0, 1.0], [np.nan, 1.0]):
        with pytest.raises(furuta.IdentificationError, match=r"std\[0\] = .* must be 0 or positive"):
            furuta.Frf(lines, lines, std)
    with pytest.raises(furuta.IdentificationError, match="show nothing above 50 Hz"):
        furuta.Frf([1.0, 60.0], lines, sample_period=0.01)
    assert furuta.Frf([1.0, 50.0], lines, sample_period=0.01).frequency[-1] == 50.0


def test_the_supervisor_goes_nowhere_that_is_no_number():
    supervisor = furuta.Supervisor(RIG)
    for target in (np.nan, np.inf):
        with pytest.raises(furuta.ControllerError, match="target = .* is not a finite number"):
            supervisor.step(0.0, 0.0, np.pi, target=target)
    assert supervisor.step(0.0, 0.0, np.pi, target=0.3)[1] == "swing-up"


def test_frequencies_are_numbers():
    K = furuta.lqr(RIG, np.eye(4), 1.0)[0]
    with pytest.raises(furuta.DesignError, match=r"omega\[0\] = NaN is not a finite number"):
        furuta.closed_loop(RIG, K, omega=[np.nan, 1.0])


def test_equal_rigs_have_equal_hashes():
    plus, minus = (RIG.with_parameters({"arm.viscous": zero}) for zero in (0.0, -0.0))
    assert plus == minus and len({plus, minus}) == 1


def test_a_list_of_nothing_is_not_everything():
    with pytest.raises(furuta.CalibrateError, match="free names nothing"):
        furuta.plan_experiment(RIG, free=[])


def test_a_state_does_not_differ_from_itself():
    t = np.arange(0, 3, 0.002)
    u = 2 * np.sin(2 * np.pi * (0.5 + t) * t)
    _, y = furuta.simulate(RIG, [0, np.pi, 0, 0], u[:-1], 0.002, encoders=True)
    recording = {"t": t, "u": u, "theta": y[:, 0], "alpha": y[:, 1]}
    with pytest.raises(furuta.DiagnoseError, match="holds the same samples as"):
        furuta.diagnose(recording, RIG, compare=recording)
    with pytest.raises(furuta.IdentificationError, match="holds the same samples as"):
        furuta.frf([recording, recording])
    with pytest.raises(furuta.IdentificationError, match="`u` is both input and output"):
        furuta.frf(recording, output="u")


def test_a_sample_is_not_longer_than_numbers_hold():
    for step in (lambda dt: furuta.zero_order_hold(*furuta.linearize(RIG), dt), lambda dt: RIG.to_ss(dt=dt)):
        with pytest.raises(furuta.DesignError, match="over dt = 1000 s an unstable mode of A grows beyond"):
            step(dt=1000.0)


def test_a_time_limit_ends():
    t = np.arange(0, 3, 0.002)
    _, y = furuta.simulate(RIG, [0, np.pi, 0, 0], np.sin(t)[:-1], 0.002, encoders=True)
    with pytest.raises(ValueError, match="time_limit is inf: give a finite number of seconds above 0, or None"):
        furuta.diagnose({"t": t, "u": np.sin(t), "theta": y[:, 0], "alpha": y[:, 1]}, RIG, time_limit=np.inf)
