"""Exported models in MuJoCo against the simulation, and the exported C file against the C compiler."""

from __future__ import annotations

import re
import shutil
import subprocess

import furuta
import numpy as np
import pytest
from command_line import furuta as program

mujoco = pytest.importorskip("mujoco")

STEP = 1e-4  # s, of MuJoCo's integrator
DT = 0.002  # s, for which a command is held

# Largest difference of the angles over half a second, rad; an encoder count is 1.5e-3. The simulation takes four
# Runge-Kutta steps to a sample, MuJoCo twenty; where the torque is smooth within a sample they agree to 1e-8.
SMOOTH = 5e-8
# The simulation finds the moment of a stop, MuJoCo's dry friction is a constraint of 0.1 ms about it; the ends of
# MuJoCo's play bounce a little. The same bounds as in test_trajectories_mujoco.py.
TOLERANCE = {"arm.coulomb": 1e-3, "pendulum.coulomb": 5e-4, "drive.backlash": 4e-3}

# What MJCF carries over, with sizes that are felt on a QUBE.
CARRIED = {
    "arm.coulomb": {"torque": 1e-3},
    "arm.spring": {"stiffness": 2e-3, "rest": -0.5},
    "arm.cable": {"stiffness": 2e-3, "asymmetry": 5e-4, "cubic": 3e-4, "rest": 0.3},
    "arm.quadratic": {"coefficient": 5e-6},
    "arm.tilt": {"angle": 0.05, "direction": 0.7, "unbalance": 0.4},
    "motor.bias": {"voltage": 0.3},
    "motor.saturation": {"limit": 2.0},
    "motor.lag": {"time_constant": 0.02},
    "drive.backlash": {"gap": 0.05, "motor_share": 0.4},
    "drive.compliance": {"stiffness": 0.5, "damping": 1e-3, "motor_share": 0.4},
    "pendulum.coulomb": {"torque": 1e-4},
    "pendulum.quadratic": {"coefficient": 1e-5},
    "pendulum.spring": {"stiffness": 1e-3, "rest": 2.5},
    "pendulum.bias": {"torque": 5e-4},
    "pendulum.inertia_transverse": {"inertia": 1e-5},
}
# What it does not.
LEFT_OUT = {
    "arm.stribeck": {"coulomb": 1e-3, "static": 2e-3, "velocity": 0.5},
    "arm.presliding": {"torque": 1e-3, "stiffness": 0.5},
    "arm.lugre": {"torque": 1e-3, "stiffness": 0.5, "damping": 1e-3},
    "arm.cogging": {"amplitude": 1e-3, "order": 6, "phase": 0.2},
    "arm.load_friction": {"coefficient": 0.2, "back_emf": 1.0},
    "arm.angle_friction": {"torque": 1e-3, "depth": 0.5, "order": 2, "phase": 0.2},
    "arm.fading_friction": {"torque": 1e-3, "time_constant": 2.0},
    "arm.relaxation": {"stiffness": 5e-3, "time_constant": 0.5},
    "arm.stop": {"stiffness": 0.5, "angle": 0.3, "damping": 1e-3, "middle": 0.0},
    "motor.resolution": {"step": 0.5},
    "motor.inductance": {"time_constant": 5e-3, "back_emf": 1.0},
    "motor.current_limit": {"limit": 0.02, "back_emf": 1.0},
    "sensor.theta.eccentricity": {"amplitude": 0.05, "phase": 0.2},
    "sensor.alpha.eccentricity": {"amplitude": 0.05, "phase": 0.2},
    "motor.deadzone": {"width": 0.2},
    "motor.delay": {"delay": 0.004},
    "motor.asymmetry": {"negative_gain": 0.9},
    "motor.drift": {"rate": 1e-3},
    "motor.ripple": {"amplitude": 0.05, "order": 6, "phase": 0.2},
    "sensor.alpha.offset": {"angle": 0.02},
    "sensor.alpha.scale": {"scale": 1.01},
    "sensor.theta.scale": {"scale": 1.01},
    "sensor.delay": {"delay": 0.004},
    "sensor.jitter": {"spread": 1e-3, "seed": 0},
    "sensor.theta.lost_counts": {"size": 0.05, "time": 1.0, "run": 0},
    "sensor.alpha.lost_counts": {"size": 0.05, "time": 1.0, "run": 0},
    "disturbance.vibration": {"amplitude": 1e-3, "frequency": 3.0, "phase": 0.0},
    "disturbance.kick": {"torque": 1e-3, "time": 1.0, "duration": 0.05, "run": 0},
    "disturbance.arm_kick": {"torque": 1e-3, "time": 1.0, "duration": 0.05, "run": 0},
}
START = {"hanging": (0.1, np.pi - 0.5, 1.0, -2.0), "falling": (0.0, 0.05, 0.0, 0.0)}
REST = (0.1, np.pi, 0.0, 0.0)  # of a drive: where the rotor stands in the middle


def commands(rig: furuta.Rig, samples: int = 250) -> np.ndarray:
    """Steps of up to 0.4 of the largest command, 20 samples each."""
    largest = rig.parameters["motor.command_limit"]
    return 0.4 * largest * np.repeat(np.random.default_rng(3).uniform(-1, 1, samples // 20 + 1), 20)[:samples]


def angles(model, x0, u, force=None) -> np.ndarray:
    """theta and alpha of a MuJoCo model; `force`: torque per volt where the model has no actuator."""
    data = mujoco.MjData(model)
    axes = [model.joint(name).qposadr[0] for name in ("theta", "alpha")]
    speeds = [model.joint(name).dofadr[0] for name in ("theta", "alpha")]
    data.qpos[axes], data.qvel[speeds] = x0[:2], x0[2:]
    if model.njnt == 3:
        rotor = model.joint("rotor")
        data.qpos[rotor.qposadr[0]], data.qvel[rotor.dofadr[0]] = x0[0], x0[2]
    track = [data.qpos[axes].copy()]
    for volts in u:
        if force is None:
            data.ctrl[0] = volts
        else:
            data.qfrc_applied[speeds[0]] = force * volts
        mujoco.mj_step(model, data, nstep=round(DT / STEP))
        track.append(data.qpos[axes].copy())
    return np.array(track)


def left_out(text: str) -> set[str]:
    return set(re.findall(r"not carried over: (\S+):", text))


def difference(rig: furuta.Rig, x0: tuple[float, ...]) -> float:
    model = mujoco.MjModel.from_xml_string(rig.to_mjcf(timestep=STEP))
    u = commands(rig)
    expected = furuta.simulate(rig, x0, u, DT, substeps=4)[:, :2]
    return float(np.abs(angles(model, x0, u) - expected).max())


@pytest.mark.parametrize("start", START)
@pytest.mark.parametrize("name", furuta.Rig.VOLTAGE)
def test_a_builtin_rig_moves_alike_in_mujoco(name, start):
    rig = furuta.Rig.load(name)
    assert left_out(rig.to_mjcf()) <= {"[sensors]", "[limits]"}
    assert difference(rig, START[start]) < SMOOTH


@pytest.mark.parametrize("effect", CARRIED)
def test_an_effect_is_carried_over(effect):
    rig = furuta.Rig.load("qube-servo-2")
    if effect == "pendulum.inertia_transverse":
        rig = rig.with_parameters({"pendulum.inertia_transverse": 0.0})  # a rod has no more than it has
    hidden = rig.with_effect(effect, **CARRIED[effect])
    assert effect not in left_out(hidden.to_mjcf())
    for x0 in [REST] if effect.startswith("drive.") else START.values():
        assert difference(hidden, x0) < TOLERANCE.get(effect, SMOOTH)
    # It is felt: without it the motion is another one.
    u = commands(rig)
    without, with_it = (furuta.simulate(r, START["hanging"], u, DT, substeps=4)[:, :2] for r in (rig, hidden))
    assert np.abs(with_it - without).max() > 5 * TOLERANCE.get(effect, SMOOTH)


def test_effects_together():
    """A repaired rig has several; voltage maps act in the catalogue's order."""
    rig = furuta.Rig.load("qube-servo-2")
    for effect in ("motor.bias", "motor.saturation", "motor.lag", "arm.cable", "arm.tilt", "arm.quadratic"):
        rig = rig.with_effect(effect, **CARRIED[effect])
    assert difference(rig, START["hanging"]) < SMOOTH


def test_no_effect_is_lost_without_a_word():
    assert CARRIED.keys().isdisjoint(LEFT_OUT) and CARRIED.keys() | LEFT_OUT.keys() == {
        id for id, of in furuta.catalogue().items() if "voltage" in of["kinds"]
    }
    for effect, values in LEFT_OUT.items():
        rig = furuta.Rig.load("qube-servo-2").with_effect(effect, **values)
        for text in (rig.to_mjcf(), rig.to_urdf()):
            assert effect in left_out(text), effect
        mujoco.MjModel.from_xml_string(rig.to_mjcf())
    of_urdf = {"arm.coulomb", "pendulum.coulomb", "pendulum.inertia_transverse"}
    planar = furuta.Rig.load("qube-servo-2").with_parameters({"pendulum.inertia_transverse": 0.0})
    for effect in CARRIED:
        text = planar.with_effect(effect, **CARRIED[effect]).to_urdf()
        assert (effect in left_out(text)) == (effect not in of_urdf), effect


def test_the_largest_command_is_the_actuators_range():
    model = mujoco.MjModel.from_xml_string(furuta.Rig.load("fong2014-emecs").to_mjcf())
    assert model.actuator("motor").ctrlrange.tolist() == [-2.4, 2.4]
    assert [model.sensor(i).name for i in range(model.nsensor)] == ["theta", "alpha"]
    assert model.key("hanging").qpos.tolist() == [0.0, np.pi]


@pytest.mark.parametrize("name", furuta.Rig.VOLTAGE)
def test_the_urdf_moves_alike_in_mujoco(name):
    rig = furuta.Rig.load(name)
    text = rig.to_urdf()
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.gravity[2] = -rig.parameters["environment.gravity"]
    torque = float(re.search(r"for one volt of command: (\S+) N m/V", text)[1])
    u, x0 = commands(rig), START["hanging"]
    expected = furuta.simulate(rig, x0, u, DT, substeps=4)[:, :2]
    # Where the hinge's inertia is no rigid body's, the file says so.
    if "pendulum.inertia" not in left_out(text):
        assert np.abs(angles(model, x0, u, torque) - expected).max() < SMOOTH


def test_what_cannot_be_exported_is_refused():
    rig = furuta.Rig.load("qube-servo-2")
    with pytest.raises(furuta.RigError, match="timestep = 1 s is outside the allowed range"):
        rig.to_mjcf(timestep=1)
    # A rod has no more; the effect is left out then, and named. A rig that is no rod without it cannot be a model.
    wider = rig.with_effect("pendulum.inertia_transverse", inertia=1e-3)
    assert "pendulum.inertia_transverse" in left_out(wider.to_mjcf()) & left_out(wider.to_urdf())
    impossible = rig.with_parameters({"pendulum.inertia_axial": 1e-3})
    for export in (impossible.to_mjcf, impossible.to_urdf):
        with pytest.raises(furuta.RigError, match="no rigid body has the pendulum's moments of inertia"):
            export()
    predictive = furuta.Controller.from_toml('[controller]\nkind = "mpc"\n', rig, dt=DT)
    with pytest.raises(furuta.ControllerError, match="can be one of lqr, lqi"):
        predictive.to_c()


@pytest.mark.skipif(not shutil.which("gcc"), reason="no gcc")
@pytest.mark.parametrize("single", [False, True])
def test_a_c_compiler_takes_the_controller(tmp_path, single):
    rig = furuta.Rig.load("qube-servo-2")
    source = tmp_path / "furuta_controller.c"
    source.write_text(furuta.Controller.from_toml("", rig, dt=DT).to_c(single=single))
    strict = "-std=c99 -Wall -Wextra -Werror -pedantic -ffp-contract=off -c -o /dev/null".split()
    subprocess.run(["gcc", *strict, str(source)], check=True)


def test_the_command_line_writes_the_same(tmp_path):
    rig = furuta.Rig.load("qube-servo-2")
    wanted = {
        ("mjcf",): rig.to_mjcf(),
        ("urdf",): rig.to_urdf(),
        ("c",): furuta.Controller.from_toml("", rig, dt=DT).to_c(),
        ("c", "--single"): furuta.Controller.from_toml("", rig, dt=DT).to_c(single=True),
    }
    for what, text in wanted.items():
        file = tmp_path / "-".join(what)
        done = program("export", *what, "--rig", "qube-servo-2", "--out", file)
        assert done.returncode == 0, done.stderr
        assert file.read_text() == text
        assert program("export", *what, "--rig", "qube-servo-2").stdout == text
    again = program("export", "mjcf", "--rig", "qube-servo-2", "--out", tmp_path / "mjcf")
    assert again.returncode == 1 and "exists already" in again.stderr
    no_rig = program("export", "c")
    assert no_rig.returncode == 1 and "--rig" in no_rig.stderr
