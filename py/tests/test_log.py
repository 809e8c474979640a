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


def test_the_model_repeats_the_run(samples):
    """Logged commands, simulated, give the logged angles: times, signs, units and the holding of u are what the log says they are."""
    rig = furuta.Rig.load("qube-servo-2")
    t, u, theta, alpha = (np.array([s[key] for s in samples], float) for key in ("t", "u", "theta", "alpha"))
    assert sum(s["lost"] for s in samples) == 0, "the machine was too slow for this test"
    np.testing.assert_allclose(np.diff(t), 0.002, atol=1e-9)
    assert np.ptp(theta) > 0.2 and np.ptp(alpha) > 0.1  # it moved
    x = furuta.simulate(rig, [theta[0], alpha[0], 0, 0], u[:-1], 0.002)
    # angles are rounded to counts (3 mrad), the first ones too: an error of half a count at the start stays one
    assert np.abs(x[:, 0] - theta).max() < 0.005
    assert np.abs(x[:, 1] - alpha).max() < 0.005


def test_a_log_cut_off_is_readable(log, samples, tmp_path):
    """A run that is killed leaves a file without its end; a stream reader gets all but the last moments of it."""
    cut = tmp_path / "cut.mcap"
    whole = log.read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    got = []
    with cut.open("rb") as file:
        try:
            for _, _, message in NonSeekingReader(file).iter_messages(log_time_order=False):
                got.append(json.loads(message.data))
        except Exception as error:  # the package's own exception types differ with the place of the cut
            print(type(error).__name__, error)
    assert len(got) > len(samples) // 4
    assert got == samples[: len(got)]
