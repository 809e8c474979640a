"""Results are values: equal where all that was found is, pickled and copied without loss; progress of a calibration."""

from __future__ import annotations

import copy
import pickle

import furuta
import numpy as np
import pytest

RIG = furuta.Rig.load("qube-servo-2")
SRV02 = furuta.Rig.load("shahzad2022-srv02")
DT = 0.002


def recording(amplitude):
    u = furuta.signal("multisine", 4.0, DT, amplitude=amplitude)
    real = RIG.with_effect("arm.spring", stiffness=2e-3, rest=0.2)
    _, y = furuta.simulate(real, [0, np.pi, 0, 0], u[:-1], DT, encoders=True)
    return {"t": DT * np.arange(len(u)), "u": u, "theta": y[:, 0], "alpha": y[:, 1]}


def averaged(data):
    """A response over lines that a short multisine does not excite, too."""
    return furuta.frf(data, resolution=1.0, estimator="H1").band(1.0, 20.0)


FIRST, SECOND = recording(1.2), recording(1.6)
# Each made twice from the same, and once from another recording.
MADE = {
    "Diagnosis": lambda data: furuta.diagnose(data, RIG, time_limit=None),
    "Calibration": lambda data: furuta.calibrate(data, RIG, free=["arm.inertia", "arm.viscous"], profile="arm.inertia"),
    "Validation": lambda data: furuta.validate(data, RIG),
    "ExperimentPlan": lambda data: furuta.plan_experiment(
        RIG, free=["arm.inertia"], rate=100.0 if data is FIRST else 200.0, experiments=1
    ),
    "Frf": lambda data: averaged(data),
    "TransferFit": lambda data: furuta.fit_transfer_function(averaged(data), 2, 4),
    "Comparison": lambda data: furuta.compare(averaged(data), RIG),
}


@pytest.mark.parametrize("what", MADE)
def test_equal_where_all_that_was_found_is(what):
    one, same, other = MADE[what](FIRST), MADE[what](FIRST), MADE[what](SECOND)
    assert one is not same and one == same and hash(one) == hash(same) and not one != same
    assert one != other and one != "text" and one != RIG
    assert copy.copy(one) == one and copy.deepcopy(one) == one
    assert len({one, same, other}) == 2
    assert repr(one).startswith(f"<furuta.{what} ")


def pages(result, folder):
    path = folder / "page.html"
    result.report(path, force=True)
    return path.read_text()


@pytest.mark.parametrize("what", ["Diagnosis", "Calibration", "Validation", "ExperimentPlan", "Frf"])
def test_pickled(what, tmp_path):
    one = MADE[what](FIRST)
    for protocol in (2, pickle.HIGHEST_PROTOCOL):
        back = pickle.loads(pickle.dumps(one, protocol))
        assert type(back) is type(one) and back == one and str(back) == str(one)
    if what == "Frf":
        for name in ("frequency", "response", "coherence", "std"):
            assert np.array_equal(getattr(back, name), getattr(one, name), equal_nan=True)
        assert furuta.fit_transfer_function(back, 2, 4) == furuta.fit_transfer_function(one, 2, 4)
    else:
        assert back.to_dict() == one.to_dict()
    if what in ("Diagnosis", "Calibration"):
        assert back.seconds == one.seconds and pages(back, tmp_path) == pages(one, tmp_path)
    if what == "Calibration":
        assert back.rig == one.rig and len(back.curves()) == len(one.curves())
    if what == "Diagnosis":
        assert back.repaired_rig == one.repaired_rig


def test_a_pickle_that_was_tampered_with():
    one = MADE["Validation"](FIRST)
    _, (json,) = one.__reduce__()
    with pytest.raises(furuta.RecordingError, match="Validation: this pickle cannot be read .*: make the result again"):
        type(one)._from_parts(json.replace('"schema"', '"shema"'))


def test_progress_of_a_calibration():
    told = []
    settings = {"free": ["arm.inertia", "arm.viscous"], "profile": "arm.inertia", "verify": SECOND}
    four = [{**FIRST, "theta": FIRST["theta"] + 0.1 * k} for k in range(4)]
    furuta.calibrate(four, RIG, **settings, progress=lambda *news: told.append(news))
    stages, percents = zip(*told)
    # Only the latest is told where two come within one look.
    order = [
        "looking for a start",
        "asking what the recordings tell",
        "fitting",
        "fitting over long windows",
        "predicting",
        "profiling",
        "verifying",
    ]
    assert [order.index(stage) for stage in stages] == sorted(order.index(stage) for stage in stages)
    assert list(percents) == sorted(percents) and 0 <= percents[0] <= percents[-1] < 100

    def stop(stage, percent):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        furuta.calibrate(FIRST, RIG, progress=stop)


def test_a_small_batch_is_the_same_as_one_by_one():
    """Few steps are done by the calling thread; progress is told there too."""
    starts = np.random.default_rng(1).uniform(-1, 1, (13, 4))
    u, told = np.linspace(-1, 1, 7), []
    found = furuta.simulate_batch(RIG, starts, u, DT, every=2, progress=lambda *news: told.append(news))
    expected = [furuta.simulate(RIG, start, u, DT)[::2] for start in starts]
    assert np.array_equal(found, expected) and told == [(13, 13)]


def test_what_is_held_under_either_name_is_held():
    found = furuta.calibrate(FIRST, RIG, fix="arm.inertia", hold="arm.length")
    assert found.fitted and not {"arm.inertia", "arm.length"} & set(found.fitted)


@pytest.mark.parametrize("spoilt", [None, "backwards", "stands", "gap", "nan"])
def test_arrays_meet_the_same_checks_with_and_without_a_further_column(spoilt):
    """Four columns of numbers are taken as they are, others through a text: messages, rows and numbers are the same."""
    data = {name: np.array(values) for name, values in FIRST.items()}
    if spoilt == "backwards":
        data["t"][700] = data["t"][600]
    if spoilt == "stands":
        data["t"][700] = data["t"][699]
    if spoilt == "gap":
        data["t"][700:] += 0.5
    if spoilt == "nan":
        data["alpha"][700] = np.nan
    said = []
    for given in (data, {**data, "further": np.arange(len(data["t"]))}):
        try:
            found = furuta.Recording(**given)
            said.append([[float(x) for x in getattr(found, k)] for k in ("t", "u", "theta", "alpha")] + [found.notices])
        except furuta.RecordingError as error:
            said.append(str(error))
    assert said[0] == said[1] and (isinstance(said[0], str)) is (spoilt in ("backwards", "stands", "nan")), said[0][-1]


def test_a_name_or_a_path_is_a_rig_in_the_loop_and_its_rehearsal(tmp_path):
    """docs/python.md: wherever a rig is asked for."""
    path = tmp_path / "rig.toml"
    SRV02.save(path)
    K = furuta.lqr(SRV02, np.diag([1, 10, 0, 0]), 0.01)[0][0]
    for given in (SRV02.name, path, str(path)):
        assert furuta.closed_loop(given, K)["growth"] == furuta.closed_loop(SRV02, K)["growth"]
        assert furuta.rehearse(given, K) == furuta.rehearse(SRV02, K)
    with pytest.raises(TypeError, match="name of a built-in rig or the path of a rig file is expected, a float"):
        furuta.rehearse(1.0, K)
