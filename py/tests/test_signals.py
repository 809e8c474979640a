"""Test signals, judged by NumPy and SciPy: spectra, peaks, bands, frequencies."""

from __future__ import annotations

import json

import furuta
import numpy as np
import pytest
import scipy.signal
from command_line import furuta as program

KINDS = ["zero", "step", "steps", "ramp", "chirp", "multisine", "prbs", "noise"]


def crest(u: np.ndarray) -> float:
    return np.abs(u).max() / np.sqrt(np.mean(u**2))


@pytest.mark.parametrize(("sweep", "method"), [("linear", "linear"), ("logarithmic", "logarithmic")])
@pytest.mark.parametrize(("f0", "f1"), [(0.1, 20.0), (20.0, 0.5)])
def test_chirp_is_scipys(sweep, method, f0, f1):
    dt, duration = 0.002, 10.0
    u = furuta.signal("chirp", duration, dt, amplitude=1.5, f0=f0, f1=f1, sweep=sweep)
    t = dt * np.arange(len(u))
    # SciPy's is a cosine. 100 turns in double precision are known to 1e-12 of a turn.
    assert np.allclose(u, 1.5 * scipy.signal.chirp(t, f0, duration, f1, method, phi=-90), rtol=0, atol=1e-10)


def test_chirp_sweeps_as_said():
    dt, duration = 0.001, 20.0
    t = dt * np.arange(round(duration / dt))
    for sweep, expected in [("linear", 2 + 38 * t / duration), ("logarithmic", 2 * 20 ** (t / duration))]:
        u = furuta.signal("chirp", duration, dt, f0=2, f1=40, sweep=sweep)
        frequency = np.diff(np.unwrap(np.angle(scipy.signal.hilbert(u)))) / (2 * np.pi * dt)
        # The analytic signal is wrong near both ends, and ripples elsewhere: smoothed over half a second.
        smooth = np.convolve(frequency, np.ones(500) / 500, "same")
        middle = slice(2000, -2000)
        assert np.abs(smooth[middle] / expected[:-1][middle] - 1).max() < 0.02


@pytest.mark.parametrize("phases", ["optimised", "schroeder", "random"])
@pytest.mark.parametrize(
    ("harmonics", "expected"),
    [("all", np.arange(1, 33)), ("odd", np.arange(1, 33, 2)), ("logarithmic", np.array([1, 2, 4, 8, 16, 32]))],
)
def test_multisine_is_flat_and_on_its_grid(harmonics, expected, phases):
    u = furuta.signal(
        "multisine",
        8,
        0.002,
        rms=2,
        fundamental=0.25,
        low=0.25,
        high=8,
        harmonics=harmonics,
        lines=6,
        phases=phases,
        seed=3,
    )
    period = 2000
    # The phase of the 32nd harmonic, after rounding of t.
    assert np.allclose(u[:period], u[period:], rtol=0, atol=1e-11)
    amplitudes = np.abs(np.fft.rfft(u[:period])) / (period / 2)
    lines = np.zeros_like(amplitudes)
    lines[expected] = 2 * np.sqrt(2 / len(expected))
    assert np.allclose(amplitudes, lines, rtol=0, atol=1e-11)
    assert np.sqrt(np.mean(u**2)) == pytest.approx(2, rel=1e-12)


def test_multisine_has_a_low_peak():
    def of(**how) -> float:
        return crest(furuta.signal("multisine", 1, 1e-4, fundamental=1, low=1, high=31, harmonics="all", **how))

    best, schroeder = of(phases="optimised"), of(phases="schroeder")
    random = [of(phases="random", seed=seed) for seed in range(20)]
    print(
        f"crest factor of 31 sines: optimised {best:.3f}, Schroeder {schroeder:.3f}, "
        f"random {min(random):.2f} to {max(random):.2f}"
    )
    assert best < 1.5 < schroeder < 1.9 < np.median(random)


@pytest.mark.parametrize("order", range(2, 15))
def test_prbs_is_a_maximum_length_sequence(order):
    n = 2**order - 1
    u = furuta.signal("prbs", n, 1, order=order, clock=1)
    assert set(u) == {-1.0, 1.0} and u.sum() == 1
    power = np.abs(np.fft.fft(u)) ** 2
    # Flat: a two-valued autocorrelation, n at no lag and -1 elsewhere, is n + 1 in every bin but that of the mean.
    assert np.allclose(power[1:], n + 1) and power[0] == pytest.approx(1)
    assert np.allclose(np.fft.ifft(power).real[1:], -1)


@pytest.mark.parametrize("order", [3, 5, 7, 9, 11, 15, 17, 18, 20])
def test_prbs_is_scipys_sequence(order):
    # The same polynomials, those with two taps: the sequence is SciPy's from another place, or backwards.
    n = 2**order - 1
    tap = {3: 2, 5: 3, 7: 6, 9: 5, 11: 9, 15: 14, 17: 14, 18: 11, 20: 17}[order]
    u = furuta.signal("prbs", 0.5 * n, 0.5, order=order, clock=0.5)
    other = 2.0 * scipy.signal.max_len_seq(order, taps=[tap])[0] - 1
    there, spectrum = np.fft.rfft(other), np.fft.rfft(u)
    found = max(np.fft.irfft(spectrum * there.conj(), n).max(), np.fft.irfft(spectrum * there, n).max())
    assert round(found) == n


def test_prbs_held():
    u = furuta.signal("prbs", 12.7, 0.01, order=7, clock=0.1, amplitude=3, seed=5)
    assert np.array_equal(np.repeat(u[::10], 10), u)
    # Held for 10 samples, the flat spectrum is shaped by the hold's own.
    power = np.abs(np.fft.rfft(u)) ** 2
    f = np.arange(1, 64)
    hold = np.sin(np.pi * f / 127) / np.sin(np.pi * f / 1270)
    assert np.allclose(power[1:64], 9 * 128 * hold**2)
    unseeded = furuta.signal("prbs", 12.7, 0.01, order=7, clock=0.1, amplitude=3)
    assert np.array_equal(np.roll(unseeded, -50), u)


@pytest.mark.parametrize(("low", "high"), [(0.5, 8.0), (0.0, 5.0), (4.0, 20.0)])
def test_noise_keeps_to_its_band(low, high):
    dt, duration, rms = 0.005, 2000.0, 0.7
    u = furuta.signal("noise", duration, dt, rms=rms, low=low, high=high, seed=11)
    # 2 B T independent numbers; five standard deviations of their RMS.
    assert np.sqrt(np.mean(u**2)) == pytest.approx(rms, rel=5 / np.sqrt(4 * (high - low) * duration))
    f, density = scipy.signal.welch(u, 1 / dt, "hann", nperseg=8192)
    # The edges are a tenth of `high` and half of `low` wide on either side; the window of the estimate leaks into a few
    # bins.
    leak = 3 * f[1]
    inside = (f > 1.55 * low + leak) & (f < 0.88 * high - leak)
    outside = (f > 1.12 * high + leak) | (f < 0.45 * low - leak)
    level = density[inside].mean()
    # Half the voltage at the edges is a quarter of the power: what is lost there is made up for inside.
    assert 1 < level / (rms**2 / (high - low)) < 1.15
    # Some 90 averages: a bin's standard deviation is a tenth, that of a quarter of the band, 30 bins and more, two
    # parts in a hundred.
    assert np.abs(density[inside] / level - 1).max() < 0.5
    for part in np.array_split(density[inside], 4):
        assert part.mean() == pytest.approx(level, rel=0.08)
    assert density[outside].max() < 2e-3 * level
    assert density[outside].sum() * f[1] < 1e-3 * rms**2


def test_noise_is_gaussian_and_its_own():
    many = np.array([furuta.signal("noise", 100, 0.05, low=0.5, high=8, seed=seed) for seed in range(20)])
    # 30,000 independent values: the standard deviations of skewness and kurtosis are 0.014 and 0.028; the numbers
    # behind it have -0.03.
    values = many.ravel() / many.std()
    assert abs(np.mean(values**3)) < 0.07 and abs(np.mean(values**4) - 3) < 0.15
    correlation = np.corrcoef(many) - np.eye(20)
    assert np.abs(correlation).max() < 5 / np.sqrt(2 * 7.5 * 100)


@pytest.mark.parametrize("kind", KINDS)
def test_a_signal_is_a_function_of_time(kind):
    parameters = {"fundamental": 0.1} if kind == "multisine" else {}
    coarse, fine = (furuta.signal(kind, 10, dt, **parameters) for dt in (0.004, 0.002))
    assert coarse.shape == (2500,) and np.allclose(coarse, fine[::2], rtol=0, atol=1e-12)
    assert np.any(coarse) == (kind != "zero")


def test_ramps_in_and_out_are_a_tukey_window():
    u = furuta.signal("step", 10, 0.01, fade_in=2, fade_out=2)
    assert np.allclose(u, scipy.signal.windows.tukey(1001, 0.4)[:-1], rtol=0, atol=1e-12)


def test_limit_step_steps_ramp():
    u = furuta.signal("noise", 20, 0.01, limit=0.8)
    assert np.abs(u).max() == 0.8
    t = 0.01 * np.arange(1000)
    assert np.array_equal(
        furuta.signal("step", 10, 0.01, amplitude=-2, start=3), np.where(np.arange(1000) < 300, 0, -2)
    )
    assert np.allclose(furuta.signal("ramp", 10, 0.01, begin=1, end=-1), 1 - t / 5)
    steps = furuta.signal("steps", 8, 0.01, amplitude=4, hold=0.5)
    assert steps.sum() == 0 and steps.max() == 4 and np.array_equal(np.repeat(steps[::50], 50), steps)


def test_frequency_response_without_leakage():
    """What the multisine is for: the response of the hanging rig, bin by bin, is the linearisation's."""
    rig, dt, f0 = furuta.Rig.load("qube-servo-2"), 0.002, 0.2
    u = furuta.signal("multisine", 100, dt, rms=0.02, fundamental=f0, low=0.2, high=10, harmonics="all")
    hanging = [0, np.pi, 0, 0]
    x = furuta.simulate(rig, hanging, u, dt)[:-1]
    period = round(1 / f0 / dt)
    response = np.fft.rfft(x[-period:], axis=0)[1:51] / np.fft.rfft(u[-period:])[1:51, None]
    A, B = furuta.zero_order_hold(*furuta.linearize(rig, x=hanging), dt)
    z = np.exp(2j * np.pi * f0 * np.arange(1, 51) * dt)
    expected = np.array([np.linalg.solve(zi * np.eye(4) - A, B)[:, 0] for zi in z])
    relative = np.abs(response / expected - 1)[:, :2]
    print(f"frequency response against the linearisation: {relative.max():.1e}")
    # What is left: the model is not linear at 20 mV, and the free motion has not quite died down.
    assert relative.max() < 0.02


@pytest.mark.parametrize(
    ("kind", "parameters", "named"),
    [
        ("sine", {}, "give one of zero, step"),
        ("step", {"amplitud": 1}, 'no parameter "amplitud": it has amplitude, start'),
        ("step", {"amplitude": float("nan")}, "amplitude = NaN"),
        ("step", {"amplitude": "two"}, "amplitude = two is not a number"),
        ("steps", {"hold": 0.001}, "sample period"),
        ("chirp", {"f1": 300}, "half the sample rate, 250 Hz"),
        ("chirp", {"f0": 0, "sweep": "logarithmic"}, "f0 = 0"),
        ("chirp", {"band": (0, 6), "sweep": "logarithmic"}, "band = 0"),
        ("ramp", {"amplitude": float("inf")}, "amplitude = inf"),
        ("ramp", {"end": float("inf")}, "end = inf"),
        ("prbs", {"hold": 0}, "hold = 0"),
        ("chirp", {"sweep": "cubic"}, "one of linear, logarithmic"),
        ("multisine", {"high": -1}, "high = -1"),
        ("multisine", {"fundamental": 0.001, "high": 1, "harmonics": "all"}, "at most 128"),
        ("multisine", {"lines": -1}, "whole number"),
        ("prbs", {"order": 21}, "[2, 20]"),
        ("prbs", {"order": 2**40}, "[2, 20]"),
        ("noise", {"low": 7}, "low = 7"),
        ("noise", {"seed": 1.5}, "whole number"),
        ("noise", {"fade_in": 20}, "fade_in = 20"),
        ("noise", {"fade": 20}, "fade = 20"),
        ("noise", {"limit": -1}, "limit = -1"),
    ],
)
def test_what_cannot_be_is_refused(kind, parameters, named):
    with pytest.raises(furuta.SignalError) as refused:
        furuta.signal(kind, 10, 0.002, **parameters)
    assert named in str(refused.value)


@pytest.mark.parametrize(
    "duration, dt", [(0, 0.01), (-1, 0.01), (float("nan"), 0.01), (10, 0), (10, float("inf")), (1e6, 1e-6)]
)
def test_times_that_cannot_be(duration, dt):
    for kind in KINDS:
        with pytest.raises(furuta.SignalError):
            furuta.signal(kind, duration, dt)


@pytest.mark.parametrize("kind", ["multisine", "prbs", "noise", "chirp"])
def test_the_command_line_has_the_same_signals(kind):
    of_kind = ["--hold", 0.04] if kind == "prbs" else ["--band", "0.2,6"]
    arguments = ["--amplitude", 1.5, "--duration", 10, "--rate", 500, *of_kind]
    arguments += ["--seed", 4] if kind in ("prbs", "noise") else []
    done = program("simulate", "--rig", "qube-servo-2", "--input", kind, *arguments, "--json")
    assert done.returncode == 0, done.stderr
    u = json.loads(done.stdout)["columns"]["u"]
    same = {
        "multisine": {"rms": 1.5},
        "prbs": {"amplitude": 1.5, "clock": 0.04, "seed": 4},
        "noise": {"rms": 1.5, "seed": 4},
        "chirp": {"amplitude": 1.5, "f0": 6, "f1": 0.2},
    }[kind]
    assert np.allclose(u, furuta.signal(kind, 10, 0.002, **same), rtol=0, atol=1e-12)
    words = {"amplitude": 1.5} | {
        "multisine": {},
        "prbs": {"hold": 0.04, "seed": 4},
        "noise": {"seed": 4},
        "chirp": {},
    }[kind]
    if kind != "prbs":
        words["band"] = (0.2, 6)
    assert np.array_equal(furuta.signal(kind, 10, 0.002, **words), furuta.signal(kind, 10, 0.002, **same))


def test_an_amplitude_is_refused_by_the_name_that_it_was_given_by():
    for kind in ("multisine", "noise"):
        for name in ("amplitude", "rms"):
            with pytest.raises(furuta.SignalError, match=name):
                furuta.signal(kind, 10, 0.002, **{name: -1})
