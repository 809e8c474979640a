"""Frequency responses and transfer functions, judged by SciPy."""

from __future__ import annotations

import json

import furuta
import numpy as np
import pytest
import scipy.optimize
import scipy.signal
from command_line import furuta as program

DT = 0.002


@pytest.fixture(scope="module")
def noise():
    """Two signals that know of one another."""
    rng = np.random.default_rng(5)
    u = rng.normal(size=20_011)
    y = scipy.signal.lfilter([0.0, 0.3, 0.1], [1.0, -1.6, 0.8], u) + 0.1 * rng.normal(size=u.size)
    return u, y


@pytest.mark.parametrize("window", ["boxcar", "hann", "hamming", "blackman", "blackmanharris", "flattop"])
@pytest.mark.parametrize(("segment", "overlap"), [(512, 256), (1000, 0), (777, 500)])
def test_spectra_are_scipys(noise, window, segment, overlap):
    u, y = noise
    ours = furuta.spectra(u, y, DT, segment, overlap=overlap, window=window)
    settings = {"fs": 1 / DT, "window": window, "nperseg": segment, "noverlap": overlap, "detrend": "constant"}
    frequency, uy = scipy.signal.csd(u, y, **settings)
    assert np.allclose(ours["frequency"], frequency, rtol=1e-13)
    # Where the mean was taken away little is left but the window's rest: relative to the largest line.
    for name, theirs in [
        ("uy", uy),
        ("uu", scipy.signal.csd(u, u, **settings)[1].real),
        ("yy", scipy.signal.csd(y, y, **settings)[1].real),
    ]:
        assert np.abs(ours[name] - theirs).max() < 1e-10 * np.abs(theirs).max()
        assert np.all(np.abs(ours[name] - theirs)[3:] < 1e-10 * np.abs(theirs)[3:])
    coherence = scipy.signal.coherence(u, y, **settings)[1]
    mine = np.abs(ours["uy"]) ** 2 / (ours["uu"] * ours["yy"])
    assert np.all(np.abs(mine - coherence)[3:] < 1e-10 * coherence[3:])


@pytest.fixture(scope="module")
def recording():
    """A hanging QUBE under noise, as its encoders read it."""
    rig = furuta.Rig.load("qube-servo-2")
    u = furuta.signal("noise", 90, DT, rms=1.0, low=0.0, high=25.0, seed=3)
    x = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], DT)
    count = 2 * np.pi / 2048
    theta, alpha = np.round(x[:, :2].T / count) * count
    return {"t": DT * np.arange(u.size), "u": u, "theta": theta, "alpha": alpha}


def test_response_is_scipys(recording):
    response = furuta.frf(recording, resolution=0.1, band=(0.2, 20), estimator="H1")
    n = round(10 / DT)
    settings = {"fs": 1 / DT, "window": "hann", "nperseg": n}
    u, y = recording["u"], recording["alpha"]
    frequency, uy = scipy.signal.csd(u, y, **settings)
    kept = (frequency > 0.2 - 1e-9) & (frequency < 20 + 1e-9)
    expected = (uy / scipy.signal.welch(u, **settings)[1])[kept]
    assert np.allclose(response.frequency, frequency[kept], rtol=1e-12)
    assert np.all(np.abs(response.response - expected) < 1e-10 * np.abs(expected))
    coherence = scipy.signal.coherence(u, y, **settings)[1][kept]
    assert np.abs(response.coherence - coherence).max() < 1e-10
    h2 = furuta.frf(recording, resolution=0.1, band=(0.2, 20), estimator="H2")
    assert np.allclose(np.abs(h2.response), np.abs(response.response) / coherence, rtol=1e-9)
    assert np.all(response.confidence(0.99) > response.confidence(0.5))


def local_rational(u, y, dt, resolution, band):
    """The local rational method in NumPy, one least squares of nine unknowns a line, and the noise's variance."""
    n = u.size
    U, Y = (np.fft.rfft(x - x.mean()) / np.sqrt(n) for x in (u, y))
    f = np.fft.rfftfreq(n, dt)
    lines = resolution * np.arange(1, round(0.5 / dt / resolution))
    lines = lines[(lines >= band[0] - 1e-9) & (lines <= band[1] + 1e-9)]
    found = []
    for f0 in lines:
        k = np.flatnonzero((np.abs(f - f0) <= resolution * (1 + 1e-6)) & (f > 0))
        r = (f[k] - f0) / resolution
        powers = r[:, None] ** np.arange(4)
        K = np.column_stack([U[k, None] * powers, powers, -Y[k] * r])
        x = np.linalg.lstsq(K, Y[k], rcond=None)[0]
        noise = np.sum(np.abs(Y[k] - K @ x) ** 2) / (k.size - 9)
        found.append((x[0], noise, np.linalg.inv(K.conj().T @ K)[0, 0].real))
    response, noise, per_noise = (np.array(each) for each in zip(*found))
    pooled = np.array([noise[max(0, k - 1) : k + 2].mean() for k in range(noise.size)])
    return lines, response, np.sqrt(pooled * per_noise)


def test_local_response_is_numpys(recording):
    band = (0.2, 20)
    ours = furuta.frf(recording, resolution=0.1, band=band)
    lines, response, std = local_rational(recording["u"], recording["alpha"], DT, 0.1, band)
    assert np.allclose(ours.frequency, lines, rtol=1e-12)
    assert np.all(np.abs(ours.response - response) < 1e-7 * np.abs(response))
    assert np.allclose(ours.std, std, rtol=1e-5)


def test_a_linear_rig_is_measured_without_leakage():
    """Noise-free linear data: the sampled transfer function by the closed form, where Hann's window leaves 0.018."""
    rig = furuta.Rig.load("fong2014-emecs")
    dt = 0.005
    A, B = furuta.linearize(rig, [0, np.pi, 0, 0])
    Ad, Bd = furuta.zero_order_hold(A, B, dt)
    u = furuta.signal("noise", 180, dt, rms=0.5, low=0.0, high=30.0, seed=1)
    _, x = scipy.signal.dlsim((Ad, Bd, np.eye(4), np.zeros((4, 1)), dt), u)[1:]
    data = {"t": dt * np.arange(u.size), "u": u, "theta": x[:, 0], "alpha": np.pi + x[:, 1]}
    truth = np.linalg.eigvals(A)
    truth = truth[np.argmax(truth.imag)]

    def error(response):
        poles = furuta.fit_transfer_function(response, 1, 3).poles
        return abs(poles[np.argmax(poles.imag)] - truth)

    response = furuta.frf(data, resolution=0.05, band=(0.1, 23))
    z = np.exp(2j * np.pi * response.frequency * dt)
    exact = np.array([np.linalg.solve(z * np.eye(4) - Ad, Bd)[1, 0] for z in z])
    assert np.abs(response.response / exact - 1).max() < 1e-3
    assert error(response) < 1e-4
    assert error(furuta.frf(data, resolution=0.05, band=(0.1, 23), estimator="H1")) > 0.005


def test_detection_lines_in_python():
    rig = furuta.Rig.load("fong2014-emecs")
    dt = 0.005

    def response(rms):
        u = furuta.signal(
            "multisine", 100, dt, rms=rms, fundamental=0.1, low=0.1, high=20, harmonics="detecting", phases="random"
        )
        # Without encoders: the steps of their counts are a distortion of their own where a swing is small.
        x = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], dt)
        return furuta.frf({"t": dt * np.arange(u.size), "u": u, "theta": x[:, 0], "alpha": x[:, 1]}, period=10.0)

    strong, weak = response(0.7), response(0.05)
    assert strong.distortion.size == strong.frequency.size == strong.band(0.1, 20).distortion.size
    assert np.all(strong.distortion <= strong.std) and np.any(strong.distortion > 0.5 * strong.std)
    assert any("deviations are widened by it" in notice for notice in strong.notices)
    share = [np.median(each.distortion / np.abs(each.response)) for each in (weak, strong)]
    assert share[0] < 0.3 * share[1]


def test_a_long_multisine_repeats_and_few_lines_are_said():
    """As the command line's, it repeats within 20 s; without its period, most of its lines fall between others."""
    rig, dt = furuta.Rig.load("qube-servo-2"), 0.002
    u = furuta.signal("multisine", 60, dt, amplitude=0.5)
    assert np.abs(u[:-10000] - u[10000:]).max() < 1e-9
    _, y = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], dt, encoders=True)
    data = {"t": dt * np.arange(len(u)), "u": u, "theta": y[:, 0], "alpha": y[:, 1]}
    few, whole = furuta.frf(data), furuta.frf(data, period=20)
    assert len(few.frequency) < 10
    assert f"{len(few.frequency)} lines only" in few.summary()
    assert "lines only" not in whole.summary()
    # The twelve sines of the default.
    assert len(whole.frequency) == 12


def test_fit_is_scipys_optimum(recording):
    response = furuta.frf(recording, resolution=0.1, band=(0.3, 15))
    fit = furuta.fit_transfer_function(response, 1, 3, hold=False)
    s = 2j * np.pi * response.frequency
    weight = 1 / np.maximum(response.std, 1e-4 * np.abs(response.response))

    def residuals(c):
        error = (np.polyval(c[:2], s) / np.polyval([1, *c[2:]], s) - response.response) * weight
        return np.concatenate([error.real, error.imag])

    start = np.concatenate([fit.numerator, fit.denominator[1:]])
    best = scipy.optimize.least_squares(
        residuals, start * 1.02, x_scale=np.abs(start) + 1e-3, xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    # The optimum is flat: its height is known better than its place.
    assert np.sum(residuals(start) ** 2) <= 2 * best.cost * (1 + 1e-8)
    assert np.allclose(best.x, start, rtol=1e-3, atol=1e-3 * np.abs(start).max())


def test_fit_finds_the_rig(recording):
    rig = furuta.Rig.load("qube-servo-2")
    response = furuta.frf(recording, resolution=0.1, band=(0.3, 15))
    fit = furuta.fit_transfer_function(response, 1, 3)
    A, _ = furuta.linearize(rig, [0, np.pi, 0, 0])
    truth = np.linalg.eigvals(A)
    truth = truth[np.abs(truth) > 1e-9]
    assert fit.stable and fit.poles.shape == (3,)
    for pole, std in zip(fit.poles, fit.poles_std):
        error = truth[np.abs(truth - pole).argmin()] - pole
        # The swing is not infinitely small: its frequency falls by 1/16 of its amplitude squared.
        assert abs(error.real) < 4 * std.real + 0.1 and abs(error.imag) < 4 * std.imag + 0.3
    num, den = fit
    w, h = scipy.signal.freqs(num, den, 2 * np.pi * response.frequency)
    held = h * np.exp(-0.5j * w * DT) * np.sinc(w * DT / 2 / np.pi)
    assert np.allclose(fit.response(response.frequency), held, rtol=1e-3)
    assert "pole" in fit.summary() and "lines" in response.summary()


def test_plot(recording):
    pytest.importorskip("matplotlib")
    response = furuta.frf(recording, resolution=0.1, band=(0.3, 15))
    figure = response.plot(fit=furuta.fit_transfer_function(response, 1, 3), flat=np.ones(response.frequency.size))
    assert [axes.get_ylabel() for axes in figure.axes] == ["magnitude [dB]", "phase [deg]", "coherence"]


@pytest.mark.parametrize(
    "model, error, says",
    [
        (np.ones(3), ValueError, r"flat has shape \(3,\); it must be a TransferFit or .* numbers of shape \(8,\)"),
        (2.0, ValueError, r"flat has shape \(\)"),
        (np.ones((8, 1)), ValueError, r"flat has shape \(8, 1\)"),
        ("ones", TypeError, r"flat must be a TransferFit or .*; a str was given"),
        ([1, [2, 3]], TypeError, "flat must be .*; a list was given"),
        (furuta.Frf([1, 2], [1, 1]), TypeError, "flat must be .*; a Frf was given"),
        (None, TypeError, "flat must be .*; a NoneType was given"),
    ],
)
def test_what_cannot_be_laid_over_a_response(model, error, says):
    pytest.importorskip("matplotlib")
    response = furuta.Frf(np.arange(1, 9), np.ones(8) + 1j)
    with pytest.raises(error, match=says):
        response.plot(flat=model)
    assert len(response.plot(flat=[1j] * 8).axes[0].lines) == 2


def test_what_is_no_system_or_no_frequency():
    control = pytest.importorskip("control")
    for given in (3, "s", np.eye(2), furuta.Frf([1, 2], [1, 1])):
        says = f"system must be a python-control .* a {type(given).__name__} was given"
        for frequency in ([1, 2], None):
            with pytest.raises(TypeError, match=says):
                furuta.Frf.from_control(given, frequency)
    system = control.tf([1], [1, 1])
    for frequency, says in (
        ("a", "frequency must be an array of numbers, Hz, ascending: .*'a'"),
        ([1j], "frequency must be an array of numbers, Hz, ascending"),
        ([], r"frequency has shape \(0,\); it must be \(N,\), N at least 1"),
        ([[1, 2], [3, 4]], r"frequency has shape \(2, 2\)"),
    ):
        with pytest.raises(furuta.IdentificationError, match=says):
            furuta.Frf.from_control(system, frequency)
    assert furuta.Frf.from_control(system, 1.0).response[0] == pytest.approx(1 / (1 + 2j * np.pi))


def test_a_hidden_spring_is_named(recording):
    rig = furuta.Rig.load("qube-servo-2")
    real = rig.with_effect("arm.spring", stiffness=0.004, rest=0.0)
    x = furuta.simulate(real, [0, np.pi, 0, 0], recording["u"][:-1], DT)
    data = dict(recording, theta=x[:, 0], alpha=x[:, 1])
    response = furuta.frf(data, output="theta", resolution=0.1, band=(0.3, 15))
    found = furuta.compare(response, rig, output="theta")
    best = found.explanations[0]
    assert best["effects"] == ["arm.spring"] and best["evidence"] > 10
    assert abs(best["values"]["arm.spring stiffness"]["value"] / 0.004 - 1) < 0.1
    assert "as its file has it: relative error" in found.summary()


def test_mistakes_are_named(recording):
    with pytest.raises(
        furuta.IdentificationError, match="needs 100.000 s without a gap, and the longest stretch has 90"
    ):
        furuta.frf(recording, resolution=0.01, estimator="H1")
    # Nine unknowns and four degrees of freedom: 13 lines within 0.02 Hz.
    with pytest.raises(furuta.IdentificationError, match="needs 650.000 s without a gap, and the longest stretch has 90"):
        furuta.frf(recording, resolution=0.01)
    with pytest.raises(furuta.IdentificationError, match="belong to averaged segments"):
        furuta.frf(recording, window="hann")
    with pytest.raises(furuta.IdentificationError, match="is constant at 0.5: it excites nothing"):
        furuta.spectra(np.full(1000, 0.5), np.arange(1000.0), DT, 100)
    with pytest.raises(furuta.IdentificationError, match="no column of numbers `excitation`"):
        furuta.frf(recording, reference="excitation")
    with pytest.raises(furuta.IdentificationError, match="there is no window"):
        furuta.frf(recording, window="kaiser", estimator="H1")
    with pytest.raises(furuta.IdentificationError, match="must be a whole number"):
        furuta.frf(recording, period=0.0031)
    with pytest.raises(furuta.IdentificationError, match="order 3 over a denominator of order 2"):
        furuta.fit_transfer_function(furuta.Frf([1, 2, 3], [1, 2j, 3]), 3, 2)
    with pytest.raises(furuta.IdentificationError, match="must ascend"):
        furuta.Frf([2, 1], [1, 1])
    with pytest.raises(furuta.IdentificationError, match=r"response\[1\] is not a finite number"):
        furuta.Frf([1, 2], [1, np.nan])
    with pytest.raises(furuta.IdentificationError, match="probability = 1 must be above 0 and below 1"):
        furuta.Frf([1, 2], [1, 1]).confidence(1.0)
    with pytest.raises(furuta.IdentificationError, match="no more zeros than poles"):
        furuta.compare(([1, 0, 0], [1, 1]), furuta.Rig.load("qube-servo-2"))


def test_program(tmp_path, recording):
    csv = tmp_path / "noise.csv"
    rows = np.column_stack([recording[name] for name in ("t", "u", "theta", "alpha")])
    np.savetxt(csv, rows, delimiter=",", header="t,u,theta,alpha", comments="")
    svg = tmp_path / "bode.svg"
    done = program("identify", "frf", csv, "--resolution", 0.1, "--band", "0.3,15", "--json", "--plot", svg)
    assert done.returncode == 0, done.stderr
    line = json.loads(done.stdout)
    mine = furuta.frf(recording, resolution=0.1, band=(0.3, 15))
    assert np.allclose(np.array(line["real"]) + 1j * np.array(line["imaginary"]), mine.response, rtol=1e-12)
    assert svg.read_text().startswith("<svg")
    done = program("identify", "tf", csv, "--resolution", 0.1, "--band", "0.3,15", "--orders", "1/3", "--json")
    assert done.returncode == 0, done.stderr
    fit = furuta.fit_transfer_function(mine, 1, 3)
    assert np.allclose(json.loads(done.stdout)["denominator"], fit.denominator, rtol=1e-6)
    done = program("identify", "compare", "--published", "fong2014", "--rig", "fong2014-emecs", "--json")
    assert done.returncode == 0, done.stderr
    singles = [e for e in json.loads(done.stdout)["explanations"] if len(e["effects"]) == 1]
    assert singles[0]["effects"] == ["arm.spring"]
    assert program("identify", "frf", csv, "--resolution", 0.01).returncode == 1
    assert program("identify", "tf", csv, "--orders", "three").returncode == 2


def test_upright_under_feedback(tmp_path):
    """The arm follows noise while the pendulum is balanced: the joint estimate is the unstable plant's response."""
    controller, csv = tmp_path / "standard.toml", tmp_path / "balance.csv"
    controller.write_text("")
    noise = ["--arm-noise", 0.1, "--band", "0.2,8", "--duration", 100, "--start", "0,0.01,0,0"]
    done = program("simulate", "--rig", "qube-servo-2", "--controller", controller, *noise, "-o", csv)
    assert done.returncode == 0, done.stderr
    joint = furuta.frf(csv, reference="reference", resolution=0.25, band=(0.75, 6))
    A, B = furuta.linearize(furuta.Rig.load("qube-servo-2"))
    Ad, Bd = furuta.zero_order_hold(A, B, joint.sample_period)
    z = np.exp(2j * np.pi * joint.frequency * joint.sample_period)
    truth = np.array([np.linalg.solve(z * np.eye(4) - Ad, Bd)[1, 0] for z in z])
    error = np.abs(joint.response / truth - 1)
    # Encoder steps and leakage of segments of 4 s.
    assert np.median(error) < 0.02 and error.max() < 0.1
    assert not joint.notices
    plain = furuta.frf(csv, resolution=0.25, band=(0.75, 6))
    assert any("made under feedback" in notice for notice in plain.notices)


def test_reports_stand_alone(recording, tmp_path):
    response = furuta.frf(recording, resolution=0.1, band=(0.3, 15))
    response.report(tmp_path / "fit.html", furuta.fit_transfer_function(response, 1, 3))
    furuta.compare(response, furuta.Rig.load("qube-servo-2")).report(tmp_path / "compare.html")
    for name, words in [("fit", "poles"), ("compare", "parameters alone")]:
        page = (tmp_path / f"{name}.html").read_text()
        assert page.startswith("<!doctype html>") and "<polyline" in page and words in page
        assert "http://" not in page.replace("http://www.w3.org/2000/svg", "") and "https://" not in page
