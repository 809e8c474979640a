"""The closed loop of a rig with its effects: against SciPy's matrices and python-control's margins."""

import control
import furuta
import numpy as np
import pytest
import scipy.linalg

RIGS = ["qube-servo-2", "shahzad2022-srv02", "fong2014-emecs"]
RATE = 500.0


def regulator(A, B):
    return furuta.lqr(A, B, np.diag([1.0, 10.0, 0.0, 0.0]), [[0.05]])[0][0]


def sensitivity_disk(L, omega):
    """2 min |1 + L| / |1 - L| on a fine grid: the disk margin without skew."""
    l = L(1j * omega) if L.dt in (0, None) else L(np.exp(1j * omega * L.dt))
    l = np.squeeze(l)
    return float(np.min(2 * np.abs(1 + l) / np.abs(1 - l)))


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("rate", [None, RATE])
def test_margins_are_those_of_python_control(name, rate):
    rig = furuta.Rig.load(name).without_effects()
    A, B = furuta.linearize(rig)
    K = regulator(A, B)
    L = control.ss(A, B, K[None, :], [[0.0]])
    if rate is not None:
        L = control.sample_system(L, 1 / rate, "zoh")
    found = furuta.closed_loop(rig, K, rate=rate)
    margins = found["margins"]
    assert margins["stable"]
    omega = np.geomspace(1e-3, np.pi * RATE, 200_001)
    for factor in margins["gain"]:
        # At the edge of stability an eigenvalue lies on the axis, or on the unit circle.
        if 0 < factor < np.inf:
            edge = np.linalg.eigvals(L.A - factor * L.B @ K[None, :])
            distance = edge.real if rate is None else np.abs(edge) - 1
            assert np.abs(distance).min() < 1e-9
    if rate is None:
        # Sampled, its polynomials lose digits near z = 1 (the disk margin below is by the response alone).
        gains, phases, _, _, w_phase, _ = control.stability_margins(L, returnall=True)
        gains, phases = np.asarray(gains), np.asarray(phases)
        above, below = gains[gains > 1], gains[gains <= 1]
        lower, upper = margins["gain"]
        assert upper == (pytest.approx(above.min(), rel=1e-6) if above.size else np.inf)
        if below.size:
            assert lower == pytest.approx(below.max(), rel=1e-6)
        assert np.degrees(margins["phase"]) == pytest.approx(np.abs(phases).min(), rel=1e-6)
        delays = np.radians(phases % 360) / w_phase
        assert margins["delay"] == pytest.approx(delays.min(), rel=1e-6)
    assert margins["disk"] == pytest.approx(sensitivity_disk(L, omega), rel=1e-5)


@pytest.mark.parametrize("name", RIGS)
def test_poles_with_a_delay_of_any_share_of_a_sample(name):
    rig = furuta.Rig.load(name)
    A, B = furuta.linearize(rig)
    K = regulator(A, B)
    h, delay = 1 / RATE, 0.0033  # a sample and 0.65 of the next
    late = rig.with_effect("motor.delay", delay=delay)
    found = furuta.closed_loop(late, K, rate=RATE)
    # By SciPy: x[k+1] = Phi x[k] + older u[k-2] + newer u[k-1].
    n = A.shape[0]

    def held(t):
        block = scipy.linalg.expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * t)
        return block[:n, :n], block[:n, n:]

    rest = delay - h
    Phi, _ = held(h)
    on, newer = held(h - rest)
    older = on @ held(rest)[1]
    closed = np.block(
        [[Phi, newer, older], [-K[None, :], np.zeros((1, 2))], [np.zeros((1, n)), np.array([[1.0, 0.0]])]]
    )
    expected = np.sort_complex(np.linalg.eigvals(closed))
    assert found["states"][4:] == ["command 1", "command 2"]
    np.testing.assert_allclose(np.sort_complex(found["poles"]), expected, atol=1e-8)
    assert found["delay"] == pytest.approx(delay)
    # The estimator looks ahead over it: prompt poles, and those of the estimator.
    prompt = scipy.linalg.eigvals(Phi - held(h)[1] @ K[None, :])
    for pole in prompt:
        assert np.abs(found["with_estimator"]["poles"] - pole).min() < 1e-3  # between two samples it goes by a line
    # The delay margin is what is left of the prompt loop's, the edge found exactly.
    prompt = furuta.closed_loop(rig, K, rate=RATE)["margins"]["delay"]
    assert found["margins"]["delay"] == pytest.approx(prompt - delay, abs=1e-6)


def test_what_is_left_out_is_said_and_described_where_asked():
    rig = furuta.Rig.load("qube-servo-2")
    K = regulator(*furuta.linearize(rig))
    dry = rig.with_effect("arm.coulomb", torque=0.001)
    plain, described = furuta.closed_loop(dry, K), furuta.closed_loop(dry, K, amplitudes=[0.5, 0.0, 0.0])
    assert "left out" in plain["remarks"]["arm.coulomb"]
    assert "describing function" in described["remarks"]["arm.coulomb"]
    assert plain["growth"] != described["growth"]
    np.testing.assert_allclose(plain["A"], furuta.closed_loop(rig, K)["A"], atol=1e-12)
    with pytest.raises(furuta.DesignError, match="4, or 5"):
        furuta.closed_loop(rig, K[:3])
    for rate in (0.0, 1e8, float("nan")):
        with pytest.raises(furuta.DesignError, match=r"outside the allowed range \[1, 20000\] Hz"):
            furuta.closed_loop(rig, K, rate=rate)
    for try_it in (lambda rate: furuta.relay(rig, rate=rate), lambda rate: furuta.rehearse(rig, K, rate=rate)):
        with pytest.raises(furuta.DesignError, match="allowed range"):
            try_it(1e12)


def test_a_delay_margin_of_many_samples_is_that_of_the_phase():
    rig = furuta.Rig.load("shahzad2022-srv02")
    K = regulator(*furuta.linearize(rig))
    fast, still = furuta.closed_loop(rig, K, rate=20_000.0)["margins"], furuta.closed_loop(rig, K)["margins"]
    assert fast["delay"] == pytest.approx(still["delay"], abs=2 / 20_000)


def test_a_rehearsal_falls_where_the_gain_does_not_hold():
    rig = furuta.Rig.load("shahzad2022-srv02")
    K = regulator(*furuta.linearize(rig))
    assert furuta.rehearse(rig, K)["fell"] is None
    assert furuta.rehearse(rig, -K)["fell"] is not None


def test_margins_of_the_least_control_are_known_in_closed_form():
    """A law that mirrors the one unstable pole p and moves no other has L = 2 p / (s - p).

    So the gain may be halved, the phase margin is 60 degrees at p sqrt(3), and |1 + L| / |1 - L| = |s + p| / |s - 3 p|
    is least at s = 0. The spring leaves no pole at 0.
    """
    rig = furuta.Rig.load("qube-servo-2").with_effect("arm.spring", stiffness=0.02, rest=0.0)
    A, B = furuta.linearize(rig)
    poles = np.linalg.eigvals(A)
    (p,) = poles[poles.real > 0].real
    margins = furuta.closed_loop(rig, furuta.place(A, B, np.where(poles.real > 0, -poles, poles)))["margins"]
    assert margins["stable"]
    assert margins["gain"] == (pytest.approx(0.5, rel=1e-6), np.inf)
    assert margins["phase"] == pytest.approx(np.pi / 3, rel=1e-6)
    assert margins["delay"] == pytest.approx(np.pi / 3 / (np.sqrt(3) * p), rel=1e-6)
    assert margins["disk"] == pytest.approx(2 / 3, rel=1e-4)


def test_controllers_and_their_files_have_a_loop(tmp_path):
    rig = furuta.Rig.load("qube-servo-2")

    def made(section):
        return furuta.Controller.from_toml(f"[controller]\n{section}\n", rig, dt=1 / RATE)

    lqr = made("")
    by_gain = furuta.closed_loop(rig, lqr.gain, rate=RATE)
    for kind in ("lqr", "mpc", "scheduled_lqr", "output_regulator"):
        found = furuta.closed_loop(rig, made(f'kind = "{kind}"'))
        assert found["margins"] == by_gain["margins"], kind
        assert found["with_estimator"]["margins"] == by_gain["with_estimator"]["margins"], kind
    lqi, pid = (furuta.closed_loop(rig, made(f'kind = "{kind}"')) for kind in ("lqi", "pid"))
    assert lqi["states"][-1] == pid["states"][-1] == "integral"
    assert lqi["margins"]["disk"] == pytest.approx(pid["margins"]["disk"], rel=1e-9)
    lqr.save(tmp_path / "lqr.toml")
    assert furuta.closed_loop(rig, tmp_path / "lqr.toml", rate=RATE)["margins"] == by_gain["margins"]
    with pytest.raises(furuta.DesignError, match="needs a rate"):
        furuta.closed_loop(rig, tmp_path / "lqr.toml")
    with pytest.raises(furuta.ControllerError, match="made for dt = 0.002 s, not for 0.01 s"):
        furuta.closed_loop(rig, lqr, rate=100.0)
    rig = rig.with_effect("motor.delay", delay=0.01)
    remembers = 'kind = "mpc"\ndelay = "motor"\n[estimator]\npredict = false'
    for section in ('kind = "lqr_sliding"', 'kind = "normal_form_sliding"', remembers):
        with pytest.raises(furuta.DesignError, match="has no linear law"):
            furuta.closed_loop(rig, made(section))
