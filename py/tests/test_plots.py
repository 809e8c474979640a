"""Figures, one call each, into axes of one's own, and cards."""

from __future__ import annotations

import subprocess
import sys

import furuta
import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.figure import Figure  # noqa: E402

RIG = furuta.Rig.load("qube-servo-2")
DT = 0.002
RUN = furuta.Trajectory.simulate(RIG, [0, 2.0, 0, 0], np.zeros(1000), DT)


@pytest.fixture(scope="module")
def data():
    u = furuta.signal("multisine", 8, DT, amplitude=1.5)
    return furuta.Trajectory.simulate(
        RIG.with_effect("arm.spring", stiffness=2e-3, rest=0.2), [0, np.pi, 0, 0], u, DT
    ).to_recording()


@pytest.fixture(scope="module")
def diagnosis(data):
    return furuta.diagnose(data, RIG)


@pytest.fixture(scope="module")
def calibration(data):
    return furuta.calibrate(data, RIG)


def written(figure, path):
    assert isinstance(figure, Figure)
    figure.savefig(path)
    assert path.stat().st_size > 2000


def test_trajectories(tmp_path):
    figure = furuta.plot.trajectory(RUN, RUN.to_recording())
    written(figure, tmp_path / "run.png")
    theta, alpha, u = figure.axes
    assert np.array_equal(theta.lines[0].get_ydata(), RUN.theta) and np.array_equal(
        alpha.lines[1].get_ydata(), RUN.y[:, 1]
    )
    assert len(u.lines) == 2
    assert [len(f.axes) for f in (RUN.plot(), RUN.to_recording().plot())] == [3, 3]


def test_phase_portraits(tmp_path):
    figure = furuta.plot.phase_portrait(RUN)
    written(figure, tmp_path / "phase.png")
    (ax,) = figure.axes
    assert np.array_equal(ax.lines[0].get_xdata(), RUN.alpha) and np.array_equal(ax.lines[0].get_ydata(), RUN.alpha_dot)
    differenced = furuta.plot.phase_portrait({"t": RUN.t, "alpha": RUN.alpha}).axes[0].lines[0].get_ydata()
    assert np.abs(differenced - RUN.alpha_dot)[5:-5].max() < 0.01 * np.abs(RUN.alpha_dot).max()
    with pytest.raises(ValueError, match="none of"):
        furuta.plot.phase_portrait(RUN, of="u")


def test_bode_plots(tmp_path, data):
    response = furuta.frf(data, band=(0.3, 6), resolution=0.25, estimator="H1")
    fit = furuta.fit_transfer_function(response, 1, 2)
    figure = furuta.plot.bode(response, fit, model=RIG)
    written(figure, tmp_path / "bode.png")
    magnitude = figure.axes[0]
    assert [line.get_label() for line in magnitude.lines] == ["measured", "fit", "model"]
    assert np.allclose(magnitude.lines[0].get_ydata(), response.magnitude_db())
    f = np.array([0.7, 3.0])
    shown = furuta.plot.bode(RIG, frequency=f).axes[0].lines[0].get_ydata()
    A, B = furuta.linearize(RIG, [0, np.pi, 0, 0])
    expected = [20 * np.log10(abs(np.linalg.solve(2j * np.pi * at * np.eye(4) - A, B)[1, 0])) for at in f]
    assert np.allclose(shown, expected)
    written(response.plot(fit=fit), tmp_path / "frf.png")


def test_diagnoses(tmp_path, diagnosis):
    parts = {
        "before_after": 2,
        "gap_map": 1,
        "evidence": 1,
        "missing_torque": 1,
    }
    for name, count in parts.items():
        figure = getattr(furuta.plot, name)(diagnosis)
        written(figure, tmp_path / f"{name}.png")
        assert len(figure.axes) == count, name
    written(diagnosis.plot(), tmp_path / "all.png")
    assert any(label.get_text() == "arm.spring" for label in furuta.plot.evidence(diagnosis).axes[0].get_yticklabels())
    labels = [line.get_label() for line in furuta.plot.before_after(diagnosis).axes[0].lines]
    assert {"measured", "parameters refitted", "repaired"} <= set(labels)
    with pytest.raises(ValueError, match="no missing torque on nowhere"):
        furuta.plot.missing_torque(diagnosis, axis="nowhere")
    with pytest.raises(KeyError, match="no recording is called 'x'"):
        furuta.plot.before_after(diagnosis, run="x")


@pytest.mark.parametrize("seconds", [-1, 0, np.nan, np.inf])
def test_a_stretch_has_a_length(diagnosis, seconds):
    for draw in (diagnosis.plot, lambda **length: furuta.plot.before_after(diagnosis, **length)):
        with pytest.raises(ValueError, match=f"seconds = {seconds} must be a finite number above 0"):
            draw(seconds=seconds)


def test_calibrations_and_validations(tmp_path, data, calibration):
    written(calibration.plot(), tmp_path / "calibration.png")
    written(furuta.plot.before_after(calibration), tmp_path / "before.png")
    written(furuta.validate(data, RIG).plot(), tmp_path / "validation.png")


@pytest.mark.parametrize("rate", [None, 500])
def test_margins_are_drawn_where_they_are(tmp_path, rate):
    rig = "shahzad2022-srv02"
    K = furuta.lqr(rig, np.diag([1, 10, 0, 0]), 0.01)[0][0]
    found = furuta.closed_loop(rig, K, rate=rate)["margins"]
    gain, phase = furuta.plot.margins(rig, K, rate=rate).axes
    marks = {line.get_label().split(" margin")[0]: line.get_xydata() for line in (*gain.lines, *phase.lines)}
    (at, top), (_, bottom) = marks["phase"]
    assert at == pytest.approx(found["frequencies"][2])
    assert abs(top - bottom) == pytest.approx(np.degrees(found["phase"]), abs=0.02)  # 2000 points, joined by lines
    assert bottom % 360 == 180
    # The curve goes through the end of each bar of a gain margin.
    bars = [line for line in gain.lines if line.get_label().startswith("gain margin")]
    assert len(bars) == sum(0 < factor < np.inf for factor in found["gain"])
    for bar in bars:
        (at, drawn), (_, zero) = bar.get_xydata()
        assert zero == 0 and drawn == pytest.approx(np.interp(at, *gain.lines[0].get_data()), abs=0.02)
    # The loop touches the disk of its disk margin from outside, and does not enter it.
    plane = furuta.plot.nyquist(rig, K, rate=rate).axes[0]
    lines = {line.get_label().split(" margin")[0]: np.asarray(line.get_data()) for line in plane.lines}
    disk, loop = lines["disk"], lines["frequencies above 0"]
    centre, radius = np.array([(disk[0].max() + disk[0].min()) / 2, 0.0]), np.ptp(disk[0]) / 2
    assert np.hypot(*(loop - centre[:, None])).min() == pytest.approx(radius, rel=1e-3)
    furuta.plot.margins(rig, K, rate=rate).savefig(tmp_path / "margins.png")
    assert (tmp_path / "margins.png").stat().st_size > 10_000


def test_regions(tmp_path):
    rig = furuta.Rig.load("shahzad2022-srv02")
    controller = furuta.Controller.from_toml("", rig, DT)
    found = furuta.region_of_attraction(rig, controller, points=15)
    of_arrays, of_rig = (
        furuta.plot.region_of_attraction(found),
        furuta.plot.region_of_attraction(rig, controller, points=15),
    )
    written(of_arrays, tmp_path / "region.png")
    shown = [np.asarray(f.axes[0].collections[0].get_array()) for f in (of_arrays, of_rig)]
    assert np.array_equal(shown[0].reshape(15, 15), found[2]) and np.array_equal(shown[0], shown[1])


def test_into_axes_of_ones_own(data, diagnosis, calibration):
    response = furuta.frf(data, band=(0.3, 6))
    comparison = furuta.compare("fong2014", "fong2014-emecs")
    one = {
        "trajectory": lambda ax: furuta.plot.trajectory(RUN, ax=ax),
        "phase": lambda ax: furuta.plot.phase_portrait(RUN, ax=ax),
        "bode": lambda ax: furuta.plot.bode(RIG, ax=ax),
        "gap": lambda ax: furuta.plot.gap_map(diagnosis, ax=ax),
        "evidence": lambda ax: furuta.plot.evidence(diagnosis, ax=ax),
        "torque": lambda ax: furuta.plot.missing_torque(diagnosis, ax=ax),
        "before_after": lambda ax: furuta.plot.before_after(diagnosis, ax=ax),
        "calibrated": lambda ax: furuta.plot.before_after(calibration, ax=ax),
        "Diagnosis": lambda ax: diagnosis.plot(ax=ax),
        "Calibration": lambda ax: calibration.plot(ax=ax),
        "Validation": lambda ax: furuta.validate(data, RIG).plot(ax=ax),
        "Frf": lambda ax: response.plot(ax=ax),
        "Comparison": lambda ax: comparison.plot(ax=ax),
        "Trajectory": lambda ax: RUN.plot(ax=ax),
        "Recording": lambda ax: data.plot(ax=ax),
        "region": lambda ax: furuta.plot.region_of_attraction(
            "shahzad2022-srv02", furuta.Controller.from_toml("", "shahzad2022-srv02", DT), points=5, ax=ax
        ),
    }
    for name, draw in one.items():
        figure = Figure()
        ax = figure.subplots()
        assert draw(ax) is figure, name
        assert figure.axes == [ax] and (ax.lines or ax.collections or ax.patches or ax.texts), name
    figure = Figure()
    axes = figure.subplots(3, 1)
    for draw in (one["Diagnosis"], one["trajectory"], one["Frf"]):
        assert draw(axes) is figure and len(figure.axes) == 3
    with pytest.raises(ValueError, match="ax holds 2 axes; 1 are needed"):
        furuta.plot.gap_map(diagnosis, ax=axes[:2])


def test_animations(tmp_path):
    from matplotlib.animation import FFMpegWriter

    from PIL import Image

    short = furuta.Trajectory.simulate(RIG, [0, 2.0, 0, 0], np.zeros(200), DT)
    short.animate(tmp_path / "swing.gif", fps=20)
    with Image.open(tmp_path / "swing.gif") as gif:
        assert gif.n_frames == 8  # 0.4 s at 20 a second
        first = np.array(gif.convert("RGB"))
        gif.seek(7)
        assert (np.array(gif.convert("RGB")) != first).any()
    furuta.plot.animation(short, tmp_path / "swing.html", fps=10)
    page = (tmp_path / "swing.html").read_text()
    assert page.startswith("<!doctype html") and "data:image/png;base64" in page
    if FFMpegWriter.isAvailable():
        short.animate(tmp_path / "swing.mp4")
        assert (tmp_path / "swing.mp4").stat().st_size > 1000
    else:
        with pytest.raises(RuntimeError, match="MP4 needs ffmpeg"):
            short.animate(tmp_path / "swing.mp4")
    with pytest.raises(ValueError, match=".gif, .html or .mp4"):
        short.animate(tmp_path / "swing.avi")
    with pytest.raises(ValueError, match="fps = 0"):
        short.animate(fps=0)
    empty = furuta.Trajectory.simulate(RIG, [0, 2.0, 0, 0], [], DT)
    with pytest.raises(ValueError, match="run is empty: no sample follows the first of 1"):
        empty.animate(tmp_path / "empty.gif")
    with pytest.raises(ValueError, match="the first of 0"):
        furuta.plot.animation({"t": [], "theta": [], "alpha": []})
    assert not (tmp_path / "empty.gif").exists()


def test_the_picture_is_the_pendulum():
    """Lengths are kept, and the tip is above the hinge upright and below it hanging."""
    from furuta.plot._animation import _joints

    theta, alpha = np.linspace(-2, 2, 9), np.linspace(-4, 4, 9)
    hinge, tip = _joints(theta, alpha, 0.2, 0.3)
    assert np.allclose(np.linalg.norm(hinge, axis=1), 0.2) and np.allclose(np.linalg.norm(tip - hinge, axis=1), 0.3)
    assert np.allclose((tip - hinge)[:, 2], 0.3 * np.cos(alpha))
    assert np.allclose(np.sum((tip - hinge) * hinge, axis=1), 0)  # the arm is the hinge's axis


def test_without_matplotlib():
    code = (
        "import sys; sys.modules['matplotlib'] = None; sys.modules['matplotlib.figure'] = None\n"
        "import furuta, numpy as np\n"
        "run = furuta.Trajectory.simulate('qube-servo-2', [0, 2, 0, 0], np.zeros(5), 0.002)\n"
        "try: run.plot()\n"
        "except ImportError as e: print(e)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install matplotlib" in done.stdout


def test_cards(data, calibration, diagnosis):
    response = furuta.frf(data, band=(0.3, 6), resolution=0.25, estimator="H1")
    controller = furuta.Controller.from_toml("", RIG, DT)
    shown = [
        (RIG.with_effect("arm.coulomb"), "arm.coulomb"),
        (controller, "command limit"),
        (furuta.Estimator("kalman", RIG, DT), "estimator kalman"),
        (furuta.Simulator(RIG, [0, 3, 0, 0], DT), "theta_dot"),
        (data, "500"),
        (RUN, "duration"),
        (furuta.validate(data, RIG), "RMS error"),
        (calibration, "<"),
        (diagnosis, "arm.spring"),
        (furuta.plan_experiment(RIG, rate=100.0, experiments=1), "V RMS"),
        (response, "Hz"),
        (furuta.fit_transfer_function(response, 1, 2), "G(s)"),
        (furuta.compare("fong2014", "fong2014-emecs"), "arm.spring"),
    ]
    for thing, word in shown:
        card = thing._repr_html_()
        assert card.startswith("<div") and word in card and "<script" not in card, type(thing)
    named = furuta.Recording(data.to_dict(), name="<b>&")
    assert "&lt;b&gt;&amp;" in named._repr_html_() and "<b>&" not in named._repr_html_()


def test_a_legend_numbers_equal_names():
    figures = furuta.plot.trajectory(RUN, RUN, {name: RUN[name] for name in ("t", "theta", "alpha", "u")}), (
        furuta.plot.phase_portrait(RUN, RUN)
    )
    named = ["qube-servo-2 (1)", "qube-servo-2 (2)"]
    for figure, wanted in zip(figures, ([*named, "run"], named)):
        assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == wanted
    assert furuta.plot.phase_portrait(RUN).axes[0].get_legend() is None


def test_whole_turns_are_counted_where_the_response_is_large():
    frequency = np.geomspace(1, 20, 60)
    model = 1 / (1 - (frequency / 2) ** 2 + 0.02j * frequency)
    # From 4 Hz on nothing but noise, whose unwrapped phase runs away by whole turns.
    noisy = np.where(frequency < 4, model, 1e-3 * np.exp(2.5j * np.arange(60)))
    figure = furuta.plot.bode(furuta.Frf(frequency, noisy), furuta.Frf(frequency[::2], model[::2]))
    measured, laid_over = (line.get_ydata() for line in figure.axes[1].get_lines())
    assert np.abs(measured[:27:2] - laid_over[:14]).max() < 1


def test_a_parameter_that_is_0_in_both():
    from types import SimpleNamespace

    from furuta.plot._calibration import plot

    zero = {"nominal": 0.0, "fitted": 0.0, "interval": [-0.1, 0.1]}
    calibration = SimpleNamespace(fitted=["arm.viscous"], parameters={"arm.viscous": zero})
    figure = plot(calibration, ax=Figure().add_subplot())
    assert np.isfinite(figure.axes[0].get_lines()[0].get_xdata()).all()
