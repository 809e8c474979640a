"""Rigs: read, changed, written, refused."""

from __future__ import annotations

import copy
import pickle

import furuta
import numpy as np
import pytest

QUBE = furuta.Rig.load("qube-servo-2")


@pytest.mark.parametrize("name", furuta.Rig.BUILTIN)
def test_round_trips(name):
    rig = furuta.Rig.load(name).with_effect("pendulum.coulomb", torque=1e-3)
    assert rig.name == name
    assert furuta.Rig.from_toml(rig.to_toml()) == rig == pickle.loads(pickle.dumps(rig)) == copy.deepcopy(rig)
    assert rig.without_effects() == furuta.Rig.load(name) != rig


def test_files(tmp_path):
    file = tmp_path / "rig.toml"
    file.write_text(QUBE.to_toml())
    assert furuta.Rig.load(file) == furuta.Rig.load(str(file)) == QUBE


def test_the_class_loads(tmp_path):
    QUBE.save(tmp_path / "rig.toml")
    assert furuta.Rig("qube-servo-2") == furuta.Rig(tmp_path / "rig.toml") == QUBE
    with pytest.raises(furuta.RigError, match="built-in rigs: fong2014-emecs"):
        furuta.Rig("no-such-rig")


def test_changes_make_new_rigs():
    other = QUBE.with_parameters({"pendulum.mass": 0.03})
    assert QUBE.parameters["pendulum.mass"] == 0.024 and other.parameters["pendulum.mass"] == 0.03
    QUBE.parameters["pendulum.mass"] = 9.0  # a copy
    assert QUBE.parameters["pendulum.mass"] == 0.024
    twice = QUBE.with_effect("arm.spring", stiffness=1e-3, rest=0.0).with_effect("arm.spring", stiffness=2e-3, rest=0.1)
    assert twice.effects == {"arm.spring": {"stiffness": 2e-3, "rest": 0.1}}
    assert "arm.spring" in repr(twice)


def valid(effect):
    """Values that every effect can have."""
    details = furuta.catalogue()[effect]["details"].items()
    return {
        name: d["choices"][-1] if d["choices"] else 2.0 if d["kind"] == "whole" else max(d["min"], 1e-3)
        for name, d in details
    }


@pytest.mark.parametrize("effect", furuta.catalogue())
def test_every_effect_can_be_had(effect):
    of_voltage = "voltage" in furuta.catalogue()[effect]["kinds"]
    rig = (QUBE if of_voltage else furuta.Rig.load("stepper-kit")).with_effect(effect, **valid(effect))
    assert rig.effects == {effect: valid(effect)}
    assert furuta.Rig.from_toml(rig.to_toml()) == rig


def test_what_is_not_given():
    rig = QUBE.with_effect("pendulum.spring", stiffness=1e-3).with_effect("drive.backlash", gap=0.05, motor_share=0.4)
    assert rig.effects["pendulum.spring"]["rest"] == np.pi
    assert rig.effects["drive.backlash"]["encoder"] == "arm"
    with pytest.raises(furuta.RigError, match="drive.backlash lacks motor_share"):
        QUBE.with_effect("drive.backlash", gap=0.05)


@pytest.mark.parametrize(("effect", "entry"), furuta.catalogue().items())
def test_the_catalogue_says_what_is_allowed(effect, entry):
    assert list(entry["details"]) == list(entry["parameters"])
    assert set(entry["look_alikes"]) <= set(furuta.catalogue()) - {effect}
    assert all(entry[text] for text in ("name", "law", "sentence", "shows", "experiment"))
    for name, d in entry["details"].items():
        assert d["unit"] == entry["parameters"][name]
        assert (d["choices"] is not None) == (d["kind"] == "choice")
        if d["kind"] != "choice":
            assert d["min"] < d["max"]
            for value in (d["max"] * 2 + 1, float("nan")):
                with pytest.raises(furuta.RigError, match=f"{name} = .*(outside the allowed range|whole number)"):
                    QUBE.with_effect(effect, **valid(effect) | {name: value})


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
        (lambda: QUBE.with_effect("arm.coulomb", torque="much"), 'torque = "much" must be a number'),
        (lambda: QUBE.with_effect("drive.backlash", encoder="gear"), 'encoder = "gear" must be "arm" or "motor"'),
        (lambda: QUBE.with_effect("arm.spring", stiffness=1e-3), "arm.spring lacks rest"),
    ],
)
def test_mistakes_are_named(call, message):
    with pytest.raises(furuta.RigError, match=message):
        call()
    assert issubclass(furuta.RigError, furuta.FurutaError) and issubclass(furuta.FurutaError, ValueError)
