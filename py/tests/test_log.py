"""The log of a run, read with the official MCAP package: what Foxglove and PlotJuggler see."""

from __future__ import annotations

import json
import pathlib

import furuta
import numpy as np
import pytest
from command_line import furuta as program
from mcap.reader import NonSeekingReader, make_reader

SECONDS = 3.0


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> pathlib.Path:
    """A hanging run of an emulated rig under a multisine, in real time through a pseudo-terminal."""
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    done = program("run", "--emulated", "qube-servo-2", "--task", "multisine", "--duration", SECONDS, "--log", path)
    assert done.returncode == 0, done.stderr
    return path


@pytest.fixture(scope="module")
def samples(log) -> list[dict[str, object]]:
    with log.open("rb") as file:
        return [json.loads(message.data) for _, _, message in make_reader(file, validate_crcs=True).iter_messages()]


def metadata(log) -> dict[str, str]:
    with log.open("rb") as file:
        (record,) = [m for m in make_reader(file).iter_metadata() if m.name == "furuta"]
    return record.metadata


def test_structure(log, samples):
    with log.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        times = [message.log_time for _, _, message in reader.iter_messages()]
    (channel,), (schema,) = summary.channels.values(), summary.schemas.values()
    assert (channel.topic, channel.message_encoding, schema.encoding) == ("/furuta/sample", "json", "jsonschema")
    assert summary.statistics.message_count == len(samples) == pytest.approx(SECONDS * 500, rel=0.02)
    assert times == sorted(times)
    described = json.loads(schema.data)
    for sample in samples:
        assert set(described["required"]) <= set(sample) <= set(described["properties"])


def test_what_the_log_says_of_itself(log):
    said = metadata(log)
    assert furuta.Rig.from_toml(said["rig_file"]) == furuta.Rig.load("qube-servo-2")
    assert said["rig"] == "qube-servo-2" and "furuta" in said["software"] and said["controller"]
    units = json.loads(said["units"])
    assert (units["t"], units["u"], units["theta"], units["alpha_dot"]) == ("s", "V", "rad", "rad/s")


def test_how_punctual_the_loop_was(log, samples, tmp_path):
    timing = furuta.timing(log)
    computed = [sample["compute"] for sample in samples]
    assert timing["period"] == 0.002 and timing["real_time"]
    compute = timing["compute"]
    assert compute["count"] == len(samples) == timing["total"]["count"]
    assert compute["max"] == pytest.approx(max(computed), abs=1e-9)
    assert compute["mean"] == pytest.approx(np.mean(computed), abs=1e-9)
    # A bucket is 1/32 wide.
    assert np.sort(computed)[int(0.5 * len(computed))] == pytest.approx(compute["p50"], rel=0.04, abs=1e-7)
    low, high, counts = compute["buckets"].T
    assert counts.sum() == len(samples) and (low <= high).all() and (np.diff(low) > 0).all()
    late = np.array([sample["delay"] for sample in samples]) + computed
    assert timing["overruns"] == (late > 0.002).sum()
    assert timing["round_trip"]["count"] > 0
    cut = tmp_path / "cut.mcap"
    whole = log.read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(furuta.RecordingError, match="how punctual"):
        furuta.timing(cut)


def test_the_model_repeats_the_run(samples):
    """Logged commands, simulated, give the logged angles: times, signs, units and the holding of u are what the log
    says they are."""
    rig = furuta.Rig.load("qube-servo-2")
    t, u, theta, alpha = (np.array([s[key] for s in samples], float) for key in ("t", "u", "theta", "alpha"))
    assert sum(s["lost"] for s in samples) == 0, "the machine was too slow for this test"
    np.testing.assert_allclose(np.diff(t), 0.002, atol=1e-9)
    assert np.ptp(theta) > 0.2 and np.ptp(alpha) > 0.1  # it moved
    x = furuta.simulate(rig, [theta[0], alpha[0], 0, 0], u[:-1], 0.002)
    # angles are rounded to counts (3 mrad), the first ones too: an error of half a count at the start stays one
    assert np.abs(x[:, 0] - theta).max() < 0.005
    assert np.abs(x[:, 1] - alpha).max() < 0.005


def test_a_log_stands_alone(log):
    said = metadata(log)
    assert json.loads(said["hello"])["rig"] == "qube-servo-2"
    assert said["protocol"] == "1" and said["format"] == "2" and said["effects"] == "" and said["host"]
    task = json.loads(said["task"])
    assert task["excite"]["excitation"]["signal"]["kind"] == "multisine"


def test_replayed_bit_for_bit(log, samples, tmp_path):
    found = furuta.replay(log)
    assert found.identical and found.same_pilot and found.equal == found.samples == len(samples)
    assert found.first is None and found.largest is None and found.missing is None and found.notice is None
    assert found.summary().startswith(f"{len(samples)} of {len(samples)} commands equal, bit for bit")
    columns = found.columns()
    np.testing.assert_array_equal(columns["command"], columns["replayed_command"])
    assert set(columns["mode"]) == set(columns["replayed_mode"]) == {"excite"}
    # another controller on the same measurements
    controller = tmp_path / "lqr.toml"
    controller.write_text('[controller]\nkind = "lqr"\n')
    other = furuta.replay(log, controller=controller)
    assert not other.same_pilot and other.largest["volts"] > 0
    # the way through CSV changes nothing; one digit does
    csv = tmp_path / "run.csv"
    assert program("convert", log, csv).returncode == 0
    lines = csv.read_text().splitlines()
    row = next(i for i, line in enumerate(lines) if line.startswith("t,")) + 500
    fields = lines[row].split(",")
    fields[7] = repr(float(fields[7]) + 1e-9)
    lines[row] = ",".join(fields)
    csv.write_text("\n".join(lines) + "\n")
    back = tmp_path / "back.mcap"
    assert program("convert", csv, back).returncode == 0
    found = furuta.replay(back)
    assert not found.identical and found.first["index"] == 499 and found.first["quantities"][0]["column"] == "command"
    with pytest.raises(furuta.RecordingError, match="another rig"):
        furuta.replay(log, rig=furuta.Rig.load("fong2014-emecs"))


def streamed(path):
    """What the official package reads of a file without its end."""
    got = []
    with path.open("rb") as file:
        try:
            for _, _, message in NonSeekingReader(file).iter_messages(log_time_order=False):
                got.append(json.loads(message.data))
        except Exception as error:  # the package's own exception types differ with the place of the cut
            print(type(error).__name__, error)
    return got


@pytest.mark.parametrize("seed", range(5))
def test_cut_at_random_bytes(log, samples, tmp_path, seed):
    """Up to the last whole chunk of 100 ms before the cut, whatever reads it."""
    whole = log.read_bytes()
    keep = int(np.random.default_rng(seed).integers(len(whole) // 4, len(whole) - 1000))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[:keep])
    got = streamed(cut)
    assert got == samples[: len(got)]
    ours = furuta.replay(cut)
    assert ours.identical and ours.samples == len(got) and "cut off" in ours.notice


def test_a_log_cut_off_is_readable(log, samples, tmp_path):
    """A run that is killed leaves a file without its end; a stream reader gets all but the last moments of it."""
    cut = tmp_path / "cut.mcap"
    whole = log.read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    got = streamed(cut)
    assert len(got) > len(samples) // 4
    assert got == samples[: len(got)]
