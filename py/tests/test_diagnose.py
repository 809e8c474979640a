"""Diagnosis of recordings that MuJoCo made, an effect hidden in them."""

from __future__ import annotations

import io
import json
import os
import signal
import sys
import threading
import xml.dom.minidom

import command_line
import furuta
import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_case import write_case  # noqa: E402
from mujoco_effects import draw_effect  # noqa: E402
from mujoco_rig import draw_rig  # noqa: E402

# One effect for each place where one can sit: arm, motor (static, delayed), pendulum, sensor; and none.
HIDDEN = {
    "arm.spring": "qube-like",
    "arm.coulomb": "srv02-like",
    "motor.deadzone": "bench-made",
    "motor.delay": "qube-like",
    "pendulum.quadratic": "emecs",
    "sensor.alpha.offset": "srv02-like",
    "nothing": "bench-made",
}


@pytest.fixture(scope="session")
def case(tmp_path_factory):
    """Folders of cases by effect, made once: data sheet 3 % off, three runs of 8 s."""
    made = {}

    def make(effect):
        if effect not in made:
            rng = np.random.default_rng(sorted(HIDDEN).index(effect) + 40)
            rig = draw_rig(HIDDEN[effect], rng)
            effects = {} if effect == "nothing" else {effect: draw_effect(effect, rig, rng)}
            made[effect] = tmp_path_factory.mktemp(effect), rig, effects
            write_case(
                made[effect][0], rig, effects, seed=77, spread=0.03, seconds=8.0, length_error=0.0, own_zeros=False
            )
        return made[effect]

    return make


@pytest.mark.parametrize("effect", HIDDEN)
def test_names_what_is_hidden(case, effect):
    folder, true, hidden = case(effect)
    rig = furuta.Rig.load(folder / "rig.toml")
    found = furuta.diagnose(sorted(folder.glob("run-*.csv")), rig)
    print(found)
    assert [e["id"] for e in found.effects] == list(hidden)
    assert found.verdict == ("missing_effects" if hidden else "parameters_only")
    assert found.repaired_rig.effects.keys() == hidden.keys()
    # Recordings show torques only against the weight m*c, which the sheet has wrong: values in N m are in its units.
    scale = rig.parameters["pendulum.mass"] * rig.parameters["pendulum.com"] / (true.pend_mass * true.pend_com)
    for id, values in hidden.items():
        name = next(iter(values))  # the first parameter is the strength
        unit = furuta.catalogue()[id]["parameters"][name]
        fitted = found.repaired_rig.effects[id][name]
        assert fitted == pytest.approx(values[name] * (scale if unit.startswith("N m") else 1.0), rel=0.1)


def test_the_repaired_model_predicts(case):
    """A run that the search has not seen, whole: 8 s open loop, hanging."""
    folder, _, _ = case("arm.spring")
    rig = furuta.Rig.load(folder / "rig.toml")
    seen, unseen = folder / "run-1-steps.csv", folder / "run-0-multisine.csv"
    found = furuta.diagnose(seen, rig, verify=[unseen])
    row = {r["channel"]: r for r in found.verification}
    assert set(row) == {"theta", "alpha"} and row["theta"]["run"] == unseen.name
    assert row["theta"]["repaired"] < 0.3 * row["theta"]["recalibrated"]
    # the same prediction with what the package gives: repaired rig, simulated
    data = np.genfromtxt(unseen, delimiter=",", names=True)
    x = furuta.simulate(found.repaired_rig, [data["theta"][0], data["alpha"][0], 0, 0], data["u"][:-1], data["t"][1])
    error = np.sqrt(np.mean((x[:, 0] - data["theta"]) ** 2))
    assert error == pytest.approx(row["theta"]["repaired"], rel=0.3, abs=0.01)


def test_arrays_are_as_good_as_files(case):
    folder, _, _ = case("motor.delay")
    rig = furuta.Rig.load(folder / "rig.toml")
    files = sorted(folder.glob("run-[01]-*.csv"))
    arrays = []
    for file in files:
        data = np.genfromtxt(file, delimiter=",", names=True)
        arrays.append({name: data[name] for name in data.dtype.names})
    one, other = (furuta.diagnose(given, rig).to_dict() for given in (files, arrays))
    for answer in (one, other):  # names of runs and seconds differ, nothing else
        answer.pop("seconds")
        answer.pop("notices", None)
        for place in answer["where"]:
            place.pop("run")
        for zero in answer["zeros"]:
            zero.pop("run")
    assert one == other


def test_what_comes_out(case, tmp_path):
    folder, _, _ = case("arm.spring")
    stages = []
    found = furuta.diagnose(
        [str(f) for f in sorted(folder.glob("run-*.csv"))],
        furuta.Rig.load(folder / "rig.toml"),
        progress=lambda stage, candidate, percent: stages.append((stage, candidate, percent)),
    )
    assert len({stage for stage, *_ in stages}) > 2 and any(candidate == "arm.spring" for _, candidate, _ in stages)
    assert all(0 <= percent <= 100 for *_, percent in stages)
    contract = json.loads(found.to_json())
    assert contract == found.to_dict() and contract["schema"] == 1
    for key in ("verdict", "effects", "parameters", "limits", "gap", "held_out", "where", "next_experiment", "seconds"):
        assert contract[key] == getattr(found, key), key
    [arm] = [t for t in found.missing_torque if t["axis"] == "theta"]
    assert arm["state"] == "theta" and arm["shape"] == "proportional" and arm["share_of_gap"] > 0.5
    by_state = found.curves()["torque_by_state"]
    assert all(len(t["at"]) == len(t["recalibrated"]) == len(t["augmented"]) for t in by_state) and len(by_state) == 10
    page = tmp_path / "report.html"
    found.report(page)
    text = page.read_text()
    assert (
        text.startswith("<!doctype html>")
        and "arm.spring" in text
        and "http://" not in text.replace("http://www.w3.org", "")
    )
    assert (
        "arm.spring" in found.summary() == str(found)
        and repr(found) == "<furuta.Diagnosis missing_effects: arm.spring>"
    )
    with pytest.raises(OSError, match="No such file"):
        found.report(tmp_path / "no" / "such" / "folder.html")
    found.report(page)  # again, over its own kind
    recording = tmp_path / "run.csv"
    recording.write_text("t,u,theta,alpha\n")
    with pytest.raises(FileExistsError, match="run.csv: exists already.*force=True"):
        found.report(recording)
    assert recording.read_text() == "t,u,theta,alpha\n"
    found.report(recording, force=True)
    assert recording.read_text() == text and {p.name for p in tmp_path.iterdir()} == {"report.html", "run.csv"}


def sweep(rig, effects, seconds=5.0):
    """What the encoders of a simulated rig read."""
    t = 0.002 * np.arange(int(seconds / 0.002) + 1)
    u = 1.5 * np.sin(3 * t * (1 + t))
    real = rig
    for id, values in effects.items():
        real = real.with_effect(id, **values)
    x = furuta.simulate(real, [0, np.pi, 0, 0], u[:-1], 0.002)
    count = 2 * np.pi / 2048
    theta, alpha = np.round(furuta.measure(real, x).T / count) * count
    return {"t": t, "u": u, "theta": theta, "alpha": alpha}


@pytest.fixture(scope="module")
def spring():
    rig = furuta.Rig.load("qube-servo-2")
    return furuta.diagnose(sweep(rig, {"arm.spring": {"stiffness": 2e-3, "rest": 0.2}}), rig)


def test_summary_is_for_people(spring):
    text = spring.summary()
    assert text.startswith("Missing from the model: spring (cable) on the arm")
    assert float(text.split("stiffness = ")[1].split()[0]) == pytest.approx(2e-3, rel=0.01)
    assert "On data that the fit had not seen" in text
    assert max(map(len, text.splitlines())) < 250 and "NaN" not in text


def test_card(spring):
    """A small piece of HTML, well-formed, with nothing to load."""
    card = spring._repr_html_()
    assert len(card) < 10_000 and "src=" not in card and "<script" not in card
    xml.dom.minidom.parseString(card)
    assert "one effect is missing" in card and "stiffness" in card and "RMS error" in card


def test_plot(spring):
    pytest.importorskip("matplotlib")
    figure = spring.plot()
    theta, alpha, error, gap, evidence = figure.axes
    measured, before, after = (line.get_ydata() for line in theta.get_lines() if line.get_label()[0] != "_")
    assert len(measured) == 2000  # 4 s
    assert np.std(after - measured) < 0.1 * np.std(before - measured)
    assert [label.get_text() for label in evidence.get_yticklabels()][0] == "arm.spring"
    figure.savefig(io.BytesIO(), format="png")
    with pytest.raises(KeyError, match="recording-0"):
        spring.plot(run="no such run")
    curves = spring.curves()
    assert len(curves["runs"][0]["t"]) == len(curves["runs"][0]["augmented"][1]) and curves["evidence"]


def test_plot_without_matplotlib(spring, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match="pip install matplotlib"):
        spring.plot()


def test_mistakes_are_refused_unless_accepted():
    rig = furuta.Rig.load("qube-servo-2")
    data = sweep(rig, {}, seconds=2.5)
    for change, says in [
        ({"alpha": data["alpha"] - np.pi}, "measured from hanging"),
        ({"u": -data["u"]}, "wrong sign"),
        ({"t": 2 * data["t"]}, "factor of 2"),
    ]:
        with pytest.raises(furuta.RecordingError, match=f"{says}.*accept_suspicious=True"):
            furuta.diagnose(data | change, rig)
    found = furuta.diagnose(data | {"u": -data["u"]}, rig, accept_suspicious=True)
    assert any("wrong sign" in notice for notice in found.notices)


def encoded(text):
    """The CSV of `furuta simulate` as encoders of 2048 counts see it."""
    rows = [line for line in text.splitlines() if not line.startswith("#")]
    data = np.genfromtxt(rows, delimiter=",", names=True)
    count = 2 * np.pi / 2048
    return {
        name: data[name] if name in "tu" else np.round(data[name] / count) * count
        for name in ("t", "u", "theta", "alpha")
    }


def test_the_planned_experiment_separates_what_was_confusable():
    """A slow sine cannot tell a shifted encoder from other effects; the experiment that the plan puts first for the
    pair, really made, names the truth, with no less evidence over the rival than was expected."""
    rig, truth = furuta.Rig.load("qube-servo-2"), "sensor.alpha.offset"

    def recorded(arguments):
        hide = ["simulate", "--rig", "qube-servo-2", "--hide", f"{truth}:angle=0.05", "--input"]
        return encoded(command_line.furuta(*hide, *arguments.split()).stdout)

    before = furuta.diagnose(recorded("chirp --amplitude 0.4 --band 1,1 --duration 6"), rig, plan=True)
    open_ = {e["id"]: e["confusable_with"] for e in before.effects}
    assert any(truth == id or truth in rivals for id, rivals in open_.items() if rivals)
    row = next(r for r in before.plan if truth in r["separates"])
    assert (
        row["expected_evidence"] == min(row["if_true"]) > 30 and row["volts"] <= rig.parameters["motor.command_limit"]
    )
    assert before.plan[0]["arguments"] in before.summary()
    (rival,) = set(row["separates"]) - {truth}
    expected = row["if_true"][row["separates"].index(truth)]

    after = furuta.diagnose(recorded(row["arguments"]), rig)
    assert [e["id"] for e in after.effects] == [truth] and rival not in after.effects[0]["confusable_with"]
    evidence = {e["id"]: e["delta_bic"] for e in after.curves()["evidence"]}
    # The search does not fit a rival that is far off to its end: it may look worse than it is, hardly better.
    found = evidence[truth] - evidence.get(rival, 0.0)
    print(row, expected, found)
    assert found > expected / 3


def columns(**changed):
    t = 0.002 * np.arange(2000)
    return {"t": t, "u": np.sin(9 * t), "theta": 0.1 * np.sin(t), "alpha": np.pi + 0.1 * np.sin(10.7 * t)} | changed


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ([], furuta.DiagnoseError, "no recording"),
        ("no-such-file.csv", furuta.RecordingError, "no-such-file.csv"),
        (columns(alpha=np.full(2000, np.nan)), furuta.RecordingError, "alpha"),
        (columns(u=np.zeros(7)), furuta.RecordingError, "`u` has 7 values"),
        ({k: v for k, v in columns().items() if k != "alpha"}, furuta.RecordingError, "no column `alpha`"),
        (columns(t=-columns()["t"]), furuta.RecordingError, "time|backwards"),
        (columns(u="volts"), furuta.RecordingError, "column `u`"),
        (columns(theta=np.zeros(2000), alpha=np.full(2000, np.pi)), furuta.DiagnoseError, "nothing moves"),
        ({k: v[:300] for k, v in columns().items()}, furuta.DiagnoseError, "at least"),
        (7, TypeError, "a recording is a path, .* or a dict of arrays"),
    ],
)
def test_unusable_recordings_are_named(given, error, message):
    with pytest.raises(error, match=message):
        furuta.diagnose(given, furuta.Rig.load("qube-servo-2"))


def test_ctrl_c(case, interruptible):
    """An interrupt ends the search and gives what is known; an error in the callback ends it at once."""
    folder, _, _ = case("arm.coulomb")
    rig, files = furuta.Rig.load(folder / "rig.toml"), sorted(folder.glob("run-*.csv"))
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt) as raised:
        for _ in range(100):
            furuta.diagnose(files, rig)
    found = raised.value.diagnosis
    assert isinstance(raised.value, furuta.Interrupted) and found.interrupted
    # What was not looked at is not claimed; what is given is sound.
    assert "search" in found.unfinished and "Interrupted" in found.summary()
    assert found.limits == [] and found.verdict in ("missing_effects", "unexplained")
    assert json.loads(found.to_json())["interrupted"] is True
    assert furuta.linearize(found.repaired_rig)[0].shape == (4, 4)

    def refuse(stage, candidate, percent):
        raise LookupError(stage)

    with pytest.raises(LookupError, match="recalibrating"):
        furuta.diagnose(files, rig, progress=refuse)


def test_the_time_limit_ends_a_search(case):
    folder, _, _ = case("arm.coulomb")
    rig, files = furuta.Rig.load(folder / "rig.toml"), sorted(folder.glob("run-*.csv"))
    found = furuta.diagnose(files, rig, time_limit=1e-3)
    assert not found.interrupted and "search" in found.unfinished and found.effects == []
    assert "time limit" in found.summary()
    for none in (0, -1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="time_limit"):
            furuta.diagnose(files, rig, time_limit=none)


def test_what_no_effect_explains_is_imitated_by_an_expression():
    """A drag of the hinge that grows with the arm's speed: in no catalogue, in the library of expressions, and in the
    repaired rig."""
    rig = furuta.Rig.load("qube-servo-2")
    hidden = rig.with_effect("custom.1", coefficient=-3e-5, on="pendulum", term="alpha_dot*abs(theta_dot)")
    t = 0.004 * np.arange(2001)
    recordings = []
    for fast, slow in ((1.3, 0.8), (1.7, -0.5)):
        u = 2.5 * np.sin(t * (2 + fast * t)) + 2 * np.sin(slow * 2.1 * t)
        theta, alpha = furuta.simulate(hidden, [0, np.pi, 0, 0], u[:-1], 0.004, encoders=True)[1].T
        recordings.append({"t": t, "u": u, "theta": theta, "alpha": alpha})
    found = furuta.diagnose(recordings, rig)
    assert found.verdict == "unexplained"
    assert found.custom is not None and found.custom["held_out_gain"] > 0.5
    (term,) = found.custom["terms"]
    assert term["on"] == "pendulum" and term["expression"].endswith("*alpha_dot*abs(theta_dot)")
    assert "no law" in found.summary() and term["expression"] in found.summary()
    effect = found.repaired_rig.effects["custom.1"]
    assert effect["term"] == "alpha_dot*abs(theta_dot)"
    assert effect["coefficient"] == pytest.approx(-3e-5, rel=0.02)  # two recordings of eight seconds


def arm_alone(rig, stiffness, seconds=8.0, dt=0.002):
    """A recording of the arm with the pendulum off: its equation alone, in steps of a tenth of a millisecond."""
    gain = rig["motor.torque_constant"] / rig["motor.resistance"]
    damping = rig["arm.viscous"] + gain * rig["motor.back_emf_constant"]
    t = dt * np.arange(round(seconds / dt))
    u = 2.0 * np.sin(2 * np.pi * t * (0.3 + 0.35 * t))
    theta, speed, angles = 0.3, 0.0, []
    for volts in u:
        angles.append(theta)
        for _ in range(20):
            speed += 1e-4 * (gain * volts - damping * speed - stiffness * (theta - 0.2)) / rig["arm.inertia"]
            theta += 1e-4 * speed
    count = 2 * np.pi / 2048
    angles = count * np.round(np.array(angles) / count)
    return {"t": t, "u": u, "theta": angles, "alpha": np.zeros_like(t)}


def test_the_arm_alone_and_another_state_of_it():
    """The cable is found with the pendulum off, and differs from the state without it."""
    rig = furuta.Rig.load("qube-servo-2")
    with_cable, without = arm_alone(rig, 2e-3), arm_alone(rig, 0.0)
    found = furuta.diagnose(with_cable, rig, compare=without, pendulum="removed")
    assert [e["id"] for e in found.effects] == ["arm.spring"]
    # Symplectic Euler at 0.1 ms moves a pole of 20 rad/s by a thousandth.
    assert found.effects[0]["parameters"]["stiffness"]["value"] == pytest.approx(2e-3, rel=0.01)
    (row,) = found.comparison["differences"]
    assert (row["id"], row["parameter"], row["differs"]) == ("arm.spring", "stiffness", True)
    assert abs(row["there"]["value"]) < 5 * row["there"]["std"] + 1e-5
    assert found.gap["nominal"]["alpha"] is None
    assert found.repaired_rig["pendulum.mass"] == rig["pendulum.mass"]
    assert furuta.diagnose(without, rig, pendulum="removed").comparison is None
    with pytest.raises(ValueError, match="swings, removed, locked, alone or driven, not off"):
        furuta.diagnose(without, rig, pendulum="off")
    with pytest.raises(ValueError, match="plan"):
        furuta.diagnose(without, rig, pendulum="locked", plan=True)
    with pytest.raises(furuta.RecordingError, match="--pendulum removed or locked"):
        furuta.diagnose(without, rig)
