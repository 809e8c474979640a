"""What a newcomer met on the first walk along the command line, one test each; `words.rs` has those about options."""

from __future__ import annotations

import re

import furuta
import numpy as np
import pytest
from command_line import ROOT
from command_line import furuta as command

QUBE = ROOT / "examples/qube-servo-2"


def helps() -> dict[tuple[str, ...], str]:
    """The help of every command, found as a reader finds them."""
    found, left = {}, [()]
    while left:
        words = left.pop()
        text = command(*words, "--help").stdout
        found[words] = text
        part = re.search(r"^Commands:\n((?:  .*\n|\n)*)", text, re.MULTILINE)
        names = re.findall(r"^  ([a-z][\w-]*)", part[1], re.MULTILINE) if part else []
        left += [(*words, name) for name in names if name != "help"]
    return found


def test_a_flag_means_the_same_everywhere():
    values: dict[str, set[str]] = {}
    for text in helps().values():
        for flag, value in re.findall(r"(--[\w-]+) <([^>]+)>", text):
            values.setdefault(flag, set()).add(value)
    assert values["--duration"] == {"SECONDS"} and values["--hold"] == {"SECONDS"}
    assert values["--time-limit"] == {"SECONDS"}
    assert values["--rate"] == {"HZ"} and values["--rig"] == {"RIG"}
    # What a command writes to is a file.
    for flag in ("--output", "--report", "--plot", "--write-rig", "--log"):
        for value in values.get(flag, ()):
            assert value == "FILE" or value.startswith(("OUT", "FILE")), (flag, value)
    assert values["--seed"] <= {"SEED", "N"}, values["--seed"]


def test_a_fit_stops_where_the_coherence_ends(tmp_path):
    dt, rng = 0.004, np.random.default_rng(1)
    u = furuta.signal("chirp", 30, dt, band=(0, 6), amplitude=1.0)
    x = furuta.simulate("shahzad2022-srv02", [0, np.pi, 0, 0], u[:-1], dt)
    theta, alpha = furuta.measure("shahzad2022-srv02", x).T
    noisy = [angle + rng.normal(0, 2e-3, len(u)) for angle in (theta, alpha)]
    furuta.Recording(t=dt * np.arange(len(u)), u=u, theta=noisy[0], alpha=noisy[1]).save(tmp_path / "run.csv")
    fit = command("identify", "tf", tmp_path / "run.csv", "--column", "alpha", "--resolution", 0.5, "--orders", "2/4")
    assert fit.returncode == 0, fit.stderr
    (end,) = re.findall(r"the coherence ends at ([\d.]+) Hz", fit.stderr)
    assert 4 < float(end) < 9  # the chirp ends at 6 Hz
    (_, last) = re.findall(r"lines from ([\d.]+) to ([\d.]+) Hz", fit.stdout)[0]
    assert float(last) == pytest.approx(float(end), abs=0.01)
    # A band that is asked for is kept.
    asked = command(
        "identify", "tf", tmp_path / "run.csv", "--column", "alpha", "--resolution", 0.5, "--orders", "2/4",
        "--estimator", "h1", "--band", "1,20",
    )  # fmt: skip
    assert "coherence ends" not in asked.stderr
    assert float(re.findall(r"to ([\d.]+) Hz", asked.stdout)[0]) > 15


def test_a_plan_says_peak_and_rms():
    plan = command("identify", "plan", "--rig", "qube-servo-2", "--free", "arm.inertia", "--rate", 100)
    assert plan.returncode == 0, plan.stderr
    header = plan.stdout.splitlines()[1]
    assert "V peak" in header and "V RMS" in header
    # A row of numbers below it: the peak is not below the RMS.
    rows = re.findall(r"^  \S.{54} +([\d.]+) +([\d.]+) +[\d.]+", plan.stdout, re.MULTILINE)
    assert rows and all(float(peak) >= float(rms) for peak, rms in rows)


def test_plus_minus_is_explained_where_it_first_stands():
    said = {
        "rigs": command("rigs", "qube-servo-2").stdout,
        "tf": command(
            "identify", "tf", QUBE / "chirp-plus-1.csv", "--column", "theta", "--resolution", 1, "--orders", "1/3"
        ).stdout,
        "compare": command("identify", "compare", "--rig", "fong2014-emecs", "--published", "fong2014").stdout,
    }
    for name, text in said.items():
        assert "±" in text, name
        before = text[: text.index("±")]
        rest = text[text.index("±") :]
        # Explained in the line itself, in the next two, or before.
        near = before.splitlines()[-1] + "\n".join(rest.splitlines()[:3]) if before else rest
        assert "one standard deviation" in before + near, (name, near)


def test_sentences_from_templates_are_english():
    """Whatever effects cannot be told apart: no verb twice, no name twice, no number with an impossible unit."""
    texts = [command("effects", effect).stdout for effect in furuta.catalogue()]
    dt = 0.002
    u = furuta.signal("steps", 8, dt, amplitude=1.5, hold=0.5)
    x = furuta.simulate(
        furuta.Rig.load("qube-servo-2").with_effect("motor.bias"), [0, np.pi, 0, 0], u[:-1], dt, encoders=True
    )[1]
    run = {"t": dt * np.arange(len(u)), "u": u, "theta": x[:, 0], "alpha": x[:, 1]}
    found = furuta.diagnose(run, "qube-servo-2", time_limit=None)
    texts += [found.summary(), found.next_experiment or "", *found.notices]
    for text in texts:
        assert text is not None
        for wrong in ("does not would", "would would", "not not", " a a ", " the the ", "None", "recording-0: recording-0"):
            assert wrong not in text, text
        for twice in re.findall(r"\b([a-z]{3,}) \1\b", text):
            assert twice in ("that", "had"), (twice, text)


def test_readme_says_how_the_command_gets_on_the_path():
    readme = (ROOT / "README.md").read_text()
    part = readme[readme.index("## What one can do") :]
    first = part[: part.index("| | |")]
    for way in ("`pip install .`", "`python -m furuta`", "`cargo install", "on the PATH", "`cargo run --release --`"):
        assert way in first, way


def test_simulate_says_what_calls_of_one_sample_forget():
    assert "Simulator" in (furuta.simulate.__doc__ or "") and "remember" in (furuta.simulate.__doc__ or "")


def test_results_have_what_readme_says():
    dt = 0.002
    u = furuta.signal("multisine", 6, dt, amplitude=1.2)
    y = furuta.simulate("qube-servo-2", [0, np.pi, 0, 0], u[:-1], dt, encoders=True)[1]
    run = furuta.Recording(t=dt * np.arange(len(u)), u=u, theta=y[:, 0], alpha=y[:, 1])
    found = furuta.diagnose(run, "qube-servo-2", time_limit=None)
    for name in ("verdict", "effects", "custom", "limits", "plan", "repaired_rig"):
        assert hasattr(found, name), name
    results = [
        found,
        furuta.calibrate(run, "qube-servo-2", free="arm.inertia"),
        furuta.validate(run, "qube-servo-2"),
        furuta.plan_experiment("qube-servo-2", free="arm.inertia", rate=100.0, experiments=1),
    ]
    for result in results:
        assert result.summary() and "<" in result._repr_html_()
    assert all(result.plot() is not None for result in results[:3])
    assert furuta.papers.__all__


def test_the_package_brings_a_real_rig():
    qube = furuta.example()
    assert qube.rig == furuta.Rig.load(QUBE / "rig.toml")
    assert {f"{name}.csv" for name in qube.runs} == {path.name for path in QUBE.glob("*.csv")}
    for name, run in qube.runs.items():
        assert all(np.array_equal(run[c], furuta.Recording(QUBE / f"{name}.csv")[c]) for c in ("t", "u", "theta", "alpha"))
    assert "SimuRLacra" in qube.about and "Redistribution" in qube.licence
    with pytest.raises(furuta.RecordingError, match='"qube" is no example .* "qube-servo-2" is'):
        furuta.example("qube")
