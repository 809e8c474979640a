"""Campaigns: a row for each case, exactly one, whoever computes it and whatever dies meanwhile."""

from __future__ import annotations

import functools
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import campaign_work
import furuta
import numpy as np
import pytest
from campaign_work import Killer, deadly, draw, long, note, raising, slowly

pa = pytest.importorskip("pyarrow")
pytest.importorskip("cloudpickle")
import pyarrow.parquet as pq  # noqa: E402

SERIAL = {"executor": "serial"}


def test_rows_depend_on_seed_and_case_alone(tmp_path):
    alone = furuta.campaign(draw, 30, seed=3, **SERIAL)
    many = furuta.campaign(draw, 30, seed=3, workers=2, out=tmp_path)
    assert alone.drop_columns("seconds") == many.drop_columns("seconds")
    children = np.random.SeedSequence(3).spawn(30)
    assert alone["drawn"].to_pylist() == [np.random.default_rng(child).normal() for child in children]
    assert alone["case"].to_pylist() == list(range(30)) and alone["twice"].to_pylist() == list(range(0, 60, 2))
    assert furuta.campaign(draw, 3, seed=4, **SERIAL)["drawn"][0] != alone["drawn"][0]


def test_a_killed_worker_loses_nothing(tmp_path):
    killer, rows = Killer(tmp_path, 120), []
    table = furuta.campaign(slowly, killer.marks, workers=2, out=tmp_path / "rows", on_row=rows.append)
    killer.judge(table)
    assert sorted(row["case"] for row in rows) == list(range(120))
    assert sorted(pq.read_table(tmp_path / "rows")["case"].to_pylist()) == list(range(120))


@pytest.mark.parametrize("retries", [0, 1])
def test_a_case_that_kills_its_worker_is_an_error_of_its_own(retries):
    table = furuta.campaign(deadly, 6, workers=2, retries=retries)
    errors = table["error"].to_pylist()
    assert f"lost {retries + 1} times at this case" in errors[3] and "signal 9" in errors[3]
    assert [errors[k] for k in (0, 1, 2, 4, 5)] == [None] * 5
    assert table["value"].to_pylist() == [0, 1, 2, None, 4, 5]


def test_a_case_that_raises_is_a_row():
    table = furuta.campaign(raising, 8, **SERIAL)
    assert table["error"].to_pylist() == [
        None,
        None,
        "ValueError: not case 2",
        None,
        None,
        None,
        None,
        "ValueError: not case 7",
    ]
    assert 'raise ValueError(f"not case' in table["traceback"][2].as_py()
    assert table["value"].to_pylist() == [0, 1, None, 3, 4, 5, 6, None]


def test_what_is_there_is_not_computed_again(tmp_path):
    marks, out = tmp_path / "marks", tmp_path / "rows"
    marks.mkdir()
    cases = [(str(marks), k) for k in range(12)]

    told = []

    def stop(done, of):
        told.append(done)
        assert of == 12
        if done >= 5:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        furuta.campaign(note, cases, out=out, progress=stop, **SERIAL)
    assert sorted(pq.read_table(out)["case"].to_pylist()) == list(range(told[-1])) and told[-1] < 12
    assert furuta.campaign(note, cases, out=out, **SERIAL)["name"].to_pylist() == list(range(12))
    more = [*cases, (str(marks), 12)]
    assert furuta.campaign(note, more, out=out, workers=1).num_rows == 13
    assert {file.name: file.read_text() for file in marks.iterdir()} == {str(k): "x" for k in range(13)}


def test_errors_are_computed_again_where_asked(tmp_path):
    flag = tmp_path / "flag"

    def moody(case):
        if case == 1 and not flag.exists():
            raise OSError("not yet")
        return case

    first = furuta.campaign(moody, 3, out=tmp_path / "rows", **SERIAL)
    flag.touch()
    assert furuta.campaign(moody, 3, out=tmp_path / "rows", **SERIAL)["error"] == first["error"]
    again = furuta.campaign(moody, 3, out=tmp_path / "rows", again=True, **SERIAL)
    assert again["error"].null_count == 3 and again["value"].to_pylist() == [0, 1, 2]
    assert sorted(pq.read_table(tmp_path / "rows")["case"].to_pylist()) == [0, 1, 2]


def scaled(factor):
    return lambda case: factor * case


def test_another_campaign_is_refused_with_what_differs(tmp_path):
    furuta.campaign(draw, [1, 2, 3], out=tmp_path, **SERIAL)
    for call, differs in (
        (lambda: furuta.campaign(draw, [1, 2, 3], out=tmp_path, seed=1), "its seed is 0, not 1"),
        (lambda: furuta.campaign(draw, [1, 5, 6], out=tmp_path), "case 1 and 1 more of its 3 cases"),
        (lambda: furuta.campaign(draw, [1, 2], out=tmp_path), "it has 3 cases, and 2 were given"),
        (lambda: furuta.campaign(raising, [1, 2, 3], out=tmp_path), "it was made by draw, not by raising"),
    ):
        with pytest.raises(furuta.CampaignError, match=differs):
            call()
    furuta.campaign(scaled(2), 2, out=tmp_path / "closure", **SERIAL)
    with pytest.raises(furuta.CampaignError, match="holds .* has changed"):
        furuta.campaign(scaled(3), 2, out=tmp_path / "closure", **SERIAL)
    partial = functools.partial(campaign_work.draw)
    assert furuta.campaign(partial, 2, out=tmp_path / "partial", **SERIAL).num_rows == 2


def test_a_file_that_changed_is_another_case(tmp_path):
    rig = tmp_path / "rig.toml"
    furuta.Rig.load("qube-servo-2").save(rig)
    cases = [{"rig": str(rig), "u": 0.5, "seconds": 0.1}]
    furuta.campaign("simulate", cases, out=tmp_path / "rows", **SERIAL)
    furuta.Rig.load("qube-servo-2").with_parameters({"pendulum.mass": 0.03}).save(rig, force=True)
    with pytest.raises(furuta.CampaignError, match="case 0 of its 1 cases is not the one given"):
        furuta.campaign("simulate", cases, out=tmp_path / "rows", **SERIAL)


def test_one_campaign_a_folder_at_a_time(tmp_path):
    def inner(row):
        with pytest.raises(furuta.CampaignError, match="another campaign is writing"):
            furuta.campaign(draw, 2, out=tmp_path, **SERIAL)

    assert furuta.campaign(draw, 2, out=tmp_path, on_row=inner, **SERIAL).num_rows == 2


def test_types_of_columns(tmp_path):
    def varied(case):
        whole = {0: None, 1: 1, 2: 0.5}.get(case, "text")
        return {"a": whole, "b": [case] if case else [], "c": {"deep": [case, np.nan]}, "d": np.bool_(case)}

    # one part per row, so that types change from part to part
    for count in range(1, 5):
        table = furuta.campaign(varied, count, out=tmp_path, **SERIAL)
    assert table["a"].to_pylist() == [None, 1.0, 0.5, None]
    assert table["b"].to_pylist() == [[], [1], [2], None]
    assert [json.loads(text) for text in table["c"].to_pylist()[:2]] == [{"deep": [0, None]}, {"deep": [1, None]}]
    assert table["d"].to_pylist() == [False, True, True, None]
    assert "column 'a' is text here and float in the rows before" in table["error"][3].as_py()
    parts = sorted(tmp_path.glob("*.parquet"))
    assert len(parts) == 4 and len({str(pq.read_schema(part)) for part in parts}) == 1


def test_a_schema_that_is_given():
    schema = pa.schema([("x", pa.float64()), ("note", pa.string())])
    table = furuta.campaign(lambda case: {"x": case} if case < 2 else {"y": 1}, 3, schema=schema, **SERIAL)
    assert table["x"].to_pylist() == [0.0, 1.0, None] and table["note"].null_count == 3
    assert "the schema has no column 'y'" in table["error"][2].as_py()


@pytest.mark.parametrize("bad", [{"case": 1}, {"x": {1, 2}}, {"x": 2**70}])
def test_rows_that_cannot_be(bad):
    assert furuta.campaign(lambda case: bad, 1, **SERIAL)["error"][0].as_py().startswith("TypeError: ")


def test_ctrl_c(interruptible, tmp_path):
    sent = []

    def interrupt():
        while not (tmp_path / "rows/_campaign.json").exists() or seen < 4:
            time.sleep(0.01)
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    seen = 0

    def count(row):
        nonlocal seen
        seen += 1

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        furuta.campaign(long, 8, out=tmp_path / "rows", workers=2, on_row=count)
    assert time.monotonic() - sent[0] < 0.5  # 0.1 s where no other process wants the cores
    assert sorted(pq.read_table(tmp_path / "rows")["case"].to_pylist()) == [0, 1, 2, 3]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_driver_that_is_killed(tmp_path):
    """Its rows are whole parts, and the campaign goes on."""
    code = (
        "import sys; sys.path[:0] = sys.argv[2:]\n"
        "import furuta; from campaign_work import slowly\n"
        "marks = [sys.argv[1] + f'/mark-{k}' for k in range(400)]\n"
        "furuta.campaign(slowly, marks, workers=2, out=sys.argv[1] + '/rows')\n"
    )
    paths = [str(pathlib.Path(__file__).parent), str(pathlib.Path(furuta.__file__).parents[1])]
    driver = subprocess.Popen([sys.executable, "-c", code, str(tmp_path), *paths])
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob("rows/part-*.parquet")) and time.monotonic() < deadline:
        time.sleep(0.02)
    driver.kill()
    driver.wait()
    there = pq.read_table(tmp_path / "rows")["case"].to_pylist()
    assert 0 < len(there) < 200 and len(set(there)) == len(there)
    rows = []
    marks = [f"{tmp_path}/mark-{k}" for k in range(400)]
    table = furuta.campaign(slowly, marks, out=tmp_path / "rows", on_row=rows.append)
    assert table["case"].to_pylist() == list(range(400))
    assert {row["case"] for row in rows} == set(range(400)) - set(there)


def test_workers_that_cannot_begin():
    module = type(sys)("nowhere_else")
    exec("def f(case): return 1", module.__dict__)
    sys.modules["nowhere_else"] = module
    try:
        with pytest.raises(furuta.CampaignError, match="cannot load the function: ModuleNotFoundError"):
            furuta.campaign(module.f, 2, workers=1)
    finally:
        del sys.modules["nowhere_else"]


def test_what_is_refused():
    for call, why in (
        (lambda: furuta.campaign("guess", 2), "'guess' is no kind of campaign: 'diagnose', 'simulate', 'study'"),
        (lambda: furuta.campaign(draw, 2, executor="cloud"), "'cloud' is none of"),
        (lambda: furuta.campaign([draw], 2), "not .<function draw"),
        (lambda: furuta.campaign(draw, 2, workers=0), "workers = 0"),
        (lambda: furuta.campaign("simulate", [{"rig": "qube-servo-2", "mass": 1}]), "case 0: 'mass' is no entry"),
        (lambda: furuta.campaign("diagnose", [{"rig": "qube-servo-2"}]), "needs 'recordings'"),
        (lambda: furuta.campaign("study", [3]), "a case of 'study' is a dict"),
    ):
        with pytest.raises(furuta.CampaignError, match=why):
            call()


def test_the_bar(capsys):
    furuta.campaign(draw, 3, progress=True, **SERIAL)
    assert "3/3" in capsys.readouterr().err


RIG = furuta.Rig.load("qube-servo-2")


def test_simulate_is_what_simulate_gives():
    coulomb = {"arm.coulomb": {"torque": 1e-3}}
    cases = [
        {"rig": RIG, "parameters": {"pendulum.mass": 0.02 + 0.003 * k}, "u": 0.5, "seconds": 0.4}
        | ({"effects": coulomb} if k % 2 else {})
        for k in range(6)
    ]
    cases += [{"rig": RIG, "x0": [0, 0.05, 0, 0], "gain": [-2, 30, -1, 2.6], "seconds": 2}]
    cases += [{"rig": RIG, "effects": {"motor.delay": {"delay": 0.004}}, "u": np.linspace(0, 1, 50), "dt": 0.004}]
    table = furuta.campaign("simulate", cases, **SERIAL)
    assert table["error"].null_count == len(cases)
    for row, case in zip(table.to_pylist(), cases):
        if "gain" in case:
            assert row["upright"] and row["up_at"] == 0.0
            continue
        rig = RIG.with_parameters(case.get("parameters", {}))
        for id, of in case.get("effects", {}).items():
            rig = rig.with_effect(id, **of)
        u, dt = case["u"], case.get("dt", 0.002)
        x = furuta.simulate(rig, [0, np.pi, 0, 0], np.full(200, u) if isinstance(u, float) else u, dt)
        assert [row[name] for name in ("theta", "alpha", "theta_dot", "alpha_dot")] == x[-1].tolist()
        assert row["arm_angle"] == abs(x[:, 0]).max() and not row["upright"]
        assert json.loads(row["changed"]) == case.get("parameters", {}) | case.get("effects", {})
    # in whatever batches
    apart = furuta.campaign("simulate", cases, workers=2)
    assert apart.drop_columns("seconds") == table.drop_columns("seconds")


def test_simulate_rigs_that_are_drawn():
    case = {"rig": "shahzad2022-srv02", "vary": {"pendulum.mass": 0.1}, "controller": "standard", "seconds": 4}
    table = furuta.campaign("simulate", [case] * 8, seed=2, workers=2)
    masses = [json.loads(text)["pendulum.mass"] for text in table["changed"].to_pylist()]
    assert len(set(masses)) == 8 and set(table["mode"].to_pylist()) == {"balance"}
    assert all(table["upright"].to_pylist()) and max(table["command"].to_pylist()) <= 10
    assert all(0.3 < at < 3.5 for at in table["up_at"].to_pylist())


def test_diagnose(tmp_path):
    dt = 0.002
    u = furuta.signal("multisine", 4, dt, amplitude=1.2)
    real = RIG.with_effect("arm.spring", stiffness=2e-3, rest=0.2)
    _, y = furuta.simulate(real, [0, np.pi, 0, 0], u[:-1], dt, encoders=True)
    recording = furuta.Recording(t=dt * np.arange(len(u)), u=u, theta=y[:, 0], alpha=y[:, 1])
    recording.save(tmp_path / "run.csv")
    wrong = furuta.Recording(t=recording.t, u=u, theta=0 * u, alpha=0 * u + np.pi)
    cases = [{"rig": RIG, "recordings": [tmp_path / "run.csv"]}, {"rig": RIG, "recordings": wrong}]
    found, failed = furuta.campaign("diagnose", cases, **SERIAL).to_pylist()
    assert (found["verdict"], found["names"]) == ("missing_effects", ["arm.spring"])
    assert json.loads(found["evidence"])[0]["delta_bic"] > 100
    assert found["after_theta"] < 0.2 * found["before_theta"]
    repaired = furuta.Rig.from_toml(found["repaired_rig"])
    assert repaired.effects["arm.spring"]["stiffness"] == pytest.approx(2e-3, rel=0.1)
    assert failed["verdict"] is None and "Error: " in failed["error"]


def test_study():
    rig = "shahzad2022-srv02"
    cases = [
        {"study": "region", "rig": rig, "points": 9},
        {"study": "swing-up", "rig": rig, "draws": 4, "patience": 10, "set": {"motor.command_limit": 12}},
        {"study": "calibration", "rig": RIG, "repeats": 2, "seconds": 3},
        {"study": "region", "rig": rig, "points": "many"},
    ]
    table = furuta.campaign("study", cases, workers=1, seed=1)
    region, swing_up, calibration, wrong = table.to_pylist()
    assert json.loads(region["answer"])["grid"]["points"] == 9 and region["seed"] is None
    answer = json.loads(swing_up["answer"])
    assert answer["draws"] == 4 and answer["seed"] == swing_up["seed"] and answer["up"] == 4
    assert json.loads(calibration["answer"])["repeats"] == 2
    assert "--points" in wrong["error"] and wrong["answer"] is None


@pytest.mark.parametrize(
    "name, options",
    [
        ("region", {"rig": "shahzad2022-srv02", "points": 7}),
        ("swing-up", {"rig": "shahzad2022-srv02", "draws": 7, "patience": 10, "seed": 3}),
        ("calibration", {"rig": RIG, "repeats": 3, "seconds": 3}),
    ],
)
def test_a_study_shared_out_is_the_study(name, options, tmp_path):
    (whole,) = furuta.campaign("study", [{"study": name, **options}], **SERIAL)["answer"].to_pylist()
    heard = []
    shared = furuta.study(
        name, parts=3, workers=2, out=tmp_path / "parts", progress=lambda *now: heard.append(now), **options
    )
    assert shared == json.loads(whole)
    assert heard[-1] == (3, 3)
    heard.clear()
    again = furuta.study(name, parts=3, out=tmp_path / "parts", progress=lambda *now: heard.append(now), **options)
    assert again == shared and heard == [(3, 3)]  # nothing was computed twice


def test_a_shared_study_that_cannot_be(tmp_path):
    with pytest.raises(furuta.CampaignError, match="'mpc' has no runs to share out; .* swing-up, region, calibration"):
        furuta.study("mpc", RIG)
    with pytest.raises(furuta.CampaignError, match="parts = 0: at least 1"):
        furuta.study("region", RIG, parts=0)
    with pytest.raises(furuta.CampaignError, match="--points"):
        furuta.study("region", RIG, points="many", parts=2, executor="serial")
    furuta.study("region", "shahzad2022-srv02", points=5, parts=2, executor="serial", plot=tmp_path / "map.svg")
    assert (tmp_path / "map.svg").read_text().startswith("<svg")
