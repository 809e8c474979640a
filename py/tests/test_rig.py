"""Rigs: read, changed, written, refused."""

from __future__ import annotations

import copy
import pickle

import furuta
import pytest

QUBE = furuta.Rig.load("qube-servo-2")


@pytest.mark.parametrize("name", furuta.Rig.BUILTIN)
def test_round_trips(name):
    rig = furuta.Rig.load(name).with_effect("arm.coulomb", torque=1e-3)
    assert rig.name == name
    assert furuta.Rig.from_toml(rig.to_toml()) == rig == pickle.loads(pickle.dumps(rig)) == copy.deepcopy(rig)
    assert rig.without_effects() == furuta.Rig.load(name) != rig


def test_files(tmp_path):
    file = tmp_path / "rig.toml"
    file.write_text(QUBE.to_toml())
    assert furuta.Rig.load(file) == furuta.Rig.load(str(file)) == QUBE


def test_changes_make_new_rigs():
    other = QUBE.with_parameters({"pendulum.mass": 0.03})
    assert QUBE.parameters["pendulum.mass"] == 0.024 and other.parameters["pendulum.mass"] == 0.03
    QUBE.parameters["pendulum.mass"] = 9.0  # a copy
    assert QUBE.parameters["pendulum.mass"] == 0.024
    twice = QUBE.with_effect("arm.spring", stiffness=1e-3).with_effect("arm.spring", stiffness=2e-3, rest=0.1)
    assert twice.effects == {"arm.spring": {"stiffness": 2e-3, "rest": 0.1}}
    assert "arm.spring" in repr(twice)


@pytest.mark.parametrize("effect", furuta.catalogue())
def test_every_effect_can_be_had(effect):
    entry = furuta.catalogue()[effect]
    rig = QUBE.with_effect(effect, **dict.fromkeys(entry["parameters"], 1e-3))
    assert furuta.Rig.from_toml(rig.to_toml()).effects == {effect: dict.fromkeys(entry["parameters"], 1e-3)}


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: furuta.Rig.load("no-such-rig"), "built-in rigs: fong2014-emecs"),
        (lambda: furuta.Rig.from_toml(QUBE.to_toml() + "\n[nonsense]\n"), "nonsense"),
        (lambda: QUBE.with_parameters({"pendulum.mass": -1.0}), r"pendulum.mass = -1 is outside"),
        (lambda: QUBE.with_parameters({"pendulum.weight": 1.0}), "no parameter `pendulum.weight`"),
        (lambda: QUBE.with_effect("arm.colomb", torque=1.0), "not in the catalogue"),
        (lambda: QUBE.with_effect("arm.coulomb", torqe=1.0), "it has torque"),
        (lambda: QUBE.with_effect("arm.coulomb", torque=-1.0), "outside the allowed range"),
    ],
)
def test_mistakes_are_named(call, message):
    with pytest.raises(furuta.RigError, match=message):
        call()
    assert issubclass(furuta.RigError, furuta.FurutaError) and issubclass(furuta.FurutaError, ValueError)
