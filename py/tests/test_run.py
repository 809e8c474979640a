"""`furuta.run` on simulated rigs: what it commands, measures and logs, and that the motor is off however it ends.

No test asserts how long anything takes; those that wait on a clock wait for more than any delay of a busy computer.
"""

from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
import textwrap

import furuta
import numpy as np
import pytest
from command_line import ROOT
from command_line import furuta as program
from simulated_io import DT, RIG, RealTime, Simulated, WithOff, late, raising, saying

# On a simulation's own time.
VIRTUAL = {"pace": "io", "any_clock": True}


def run(io, duration=1.0, **keywords):
    return furuta.run(RIG, io=io, duration=duration, **(VIRTUAL | keywords))


def ended(io, duration=1.0, error=furuta.RunError, **keywords):
    """A run that ends before its time, the motor off."""
    with pytest.raises(error) as caught:
        run(io, duration, **keywords)
    assert io.volts[-3:] == [0.0, 0.0, 0.0]
    return caught.value


def test_it_swings_up_and_balances():
    io = Simulated()
    done = run(io, 3.0)
    assert (done.mode[0], done.mode[-1], done.samples, done.end) == ("swing-up", "balance", 1501, "finished")
    upright = done.alpha[done.t > 2.0]
    assert np.abs(np.angle(np.exp(1j * upright))).max() < 0.05
    assert np.array_equal(done.t, np.round(np.arange(1501) * 2000.0) * 1e-6) and not done.lost.any()
    # What was decided at a sample is what the motor holds from the next one on.
    assert done.u[0] == 0 and np.array_equal(done.u[1:], done.command[:-1].astype(np.float32))
    assert io.volts[: done.samples] == done.u.tolist() and io.volts[done.samples :] == [0.0, 0.0, 0.0]
    assert np.abs(done.u).max() == RIG["motor.command_limit"]


def test_it_is_the_supervisor():
    """The same as the loop that docs/python.md shows, but for the rounding of a volt on the wire."""
    done = run(Simulated(), 0.5)
    supervisor, plant, u = furuta.Supervisor(RIG), furuta.Simulator(RIG, [0, np.pi, 0, 0], DT), 0.0
    for k in range(done.samples):
        held, (u, mode) = u, supervisor.step(plant.t, *plant.reading)
        assert done.mode[k] == mode and abs(done.command[k] - u) < 1e-3
        plant.step(held)


def test_the_arm_is_stepped():
    done = run(Simulated(), 8.0, arm_steps=0.3)
    since = done.t[done.mode.index("balance")]
    # A step is led to at 1 rad/s; the first is to the middle, from where the arm caught the pendulum.
    assert not done.reference[(done.t > since + 1.96) & (done.t < since + 1.99)].any()
    for begin, angle in ((3.0, 0.3), (5.0, -0.3)):
        at = (done.t > since + begin) & (done.t < since + begin + 0.9)
        assert np.allclose(done.reference[at], angle) and abs(done.theta[at].mean() - angle) < 0.1


@pytest.mark.parametrize("how", ["argument", "attribute"])
def test_counts_are_the_rig_files(how):
    class Counts(Simulated):
        def exchange(self, volts):
            theta, alpha = super().exchange(volts)
            return round(theta * 2048 / (2 * np.pi)), np.int32(round((alpha - np.pi) * 2048 / (2 * np.pi)))

    io = Counts()
    if how == "attribute":
        io.counts = True
    done = run(io, **({"counts": True} if how == "argument" else {}))
    angles = run(Simulated())
    for name in ("theta", "alpha", "command"):
        assert np.array_equal(getattr(done, name), getattr(angles, name))
    with pytest.raises(furuta.RunError, match=r"theta = 0.5, which is not a whole number .* whole numbers, 0 at the"):
        run(Halves(), counts=True)


class Halves(Simulated):
    def exchange(self, volts):
        super().exchange(volts)
        return 0.5, 0


@pytest.mark.parametrize("pace", ["ours", "io"])
def test_in_real_time(pace):
    io = RealTime() if pace == "io" else Simulated()
    # Busy computers are late by tens of milliseconds; 3 s are not counted on.
    done = furuta.run(RIG, io=io, duration=1.0, pace=pace, late_limit=3.0)
    assert done.end == "finished" and done.t[-1] >= 1.0 and "swing-up" in done.mode
    assert done.samples + done.lost.sum() == done.seq[-1] + 1
    assert np.isfinite(done.lateness).all() and (done.lateness >= 0).all() and (done.exchange > 0).all()
    assert f"{done.samples} samples, finished" in done.summary() and "late [us]" in done.summary()


def test_samples_are_lost_where_a_call_takes_long():
    done = furuta.run(RIG, io=Simulated(at={5: late(0.3)}), duration=1.0, late_limit=5.0)
    at = int(np.argmax(done.lateness))
    assert done.lateness[at] > 0.3 and done.lost[at] >= 149 and done.late >= 1
    assert np.array_equal(np.diff(done.seq), done.lost[1:] + 1)


@pytest.mark.parametrize("pace", ["ours", "io"])
def test_a_late_sample_ends_the_run(pace):
    io = (RealTime if pace == "io" else Simulated)(at={5: late(1.0)})
    error = ended(io, pace=pace, any_clock=False, late_limit=0.5)
    assert "ms late, the limit is 500.0 ms at t = " in str(error) and "motor off; see what else" in str(error)
    assert len(error.run) == 5 and error.run.end in str(error)


def test_ten_periods_are_late():
    error = ended(Simulated(at={3: late(0.5)}), pace="ours", any_clock=False)
    assert "the limit is 20.0 ms" in str(error)


def test_a_call_that_does_not_return_is_switched_off_meanwhile():
    io = WithOff(at={5: late(2.5)})
    with pytest.raises(furuta.RunError, match="did not return for more than 1000.0 ms, and off.. was called meanwhile"):
        furuta.run(RIG, io=io, late_limit=1.0)
    assert io.events.index("off") == 5  # before the sixth call returned
    assert io.events[-3:] == ["off", "off", "off"]


@pytest.mark.parametrize("pace", ["ours", "io"])
def test_the_first_call_may_take_long(pace):
    class Slow(RealTime, WithOff):
        pass

    done = furuta.run(RIG, io=Slow(at={0: late(1.2)}), duration=0.1, pace=pace, late_limit=1.0)
    assert done.end == "finished" and done.lateness[0] == 0.0


def test_an_object_that_raises():
    class CardError(Exception):
        pass

    card = CardError("unplugged")
    error = ended(Simulated(at={200: raising(card)}))
    assert str(error) == (
        "io.exchange raised CardError: unplugged at t = 0.398 s: motor off; see the error above, and the rig's cables"
    )
    assert error.__cause__ is card and len(error.run) == 200 and error.run.alpha[0] == np.pi


def test_a_motor_that_cannot_be_switched_off_is_said():
    io = Simulated(at={k: raising(OSError("gone")) for k in range(20, 40)})
    with pytest.raises(furuta.RunError, match=r"motor NOT OFF, io raised OSError: gone; switch the rig off by hand"):
        run(io)
    # One of three is enough.
    io = Simulated(at={k: raising(OSError("gone")) for k in (20, 21, 22)})
    with pytest.raises(furuta.RunError, match="motor off"):
        run(io)
    # Without reading.
    io = WithOff(at={k: raising(OSError("gone")) for k in range(20, 40)})
    with pytest.raises(furuta.RunError, match="motor off"):
        run(io)
    assert io.events[-3:] == ["off"] * 3 and len(io.volts) == 21


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ((float("nan"), 0.0), "returned theta = nan, which is not a finite number"),
        ((0.0, np.inf), "returned alpha = inf"),
        ((0.0, None), "returned alpha = None"),
        (("left", 0.0), "returned theta = 'left'"),
        (None, "returned None at"),
        (0.1, "returned 0.1 at"),
        ((0.1, 0.2, 0.3), "returned (0.1, 0.2, 0.3) at"),
        (np.zeros((2, 2)), "returned theta = array"),
    ],
)
def test_what_is_no_pair_of_angles(value, says):
    error = ended(Simulated(at={150: saying(value)}))
    assert says in str(error) and "return both angles in rad, (theta, alpha)" in str(error)
    assert len(error.run) == 150 and np.isfinite(error.run.command).all()


def test_frozen_encoders():
    class Arm(Simulated):
        def exchange(self, volts):
            return 0.3, super().exchange(volts)[1]

    class Pendulum(Simulated):
        def exchange(self, volts):
            return super().exchange(volts)[0], np.pi

    error = ended(Arm(), 5.0)
    assert "theta has read 0.3 rad" in str(error) and "amplifier is enabled" in str(error)
    error = ended(Pendulum(), 5.0)
    assert "alpha has read 3.14159 rad for 0.5 s while the arm moved by" in str(error)
    # A motor that is not enabled: nothing moves.
    error = ended(Simulated(at={k: saying((0.0, np.pi)) for k in range(5000)}), 5.0)
    assert "while the motor was driven with" in str(error)


def test_a_limit_brakes_and_ends_the_run():
    rig = furuta.Rig.from_toml(RIG.to_toml() + "\n[limits]\narm_angle = 0.5\n")
    io = Simulated(rig)
    io.plant.reset([0.4, np.pi, 8.0, 0.0])
    with pytest.raises(furuta.RunError, match="arm at .* beyond its limit of 0.500 rad at t = .*: motor off; bri") as e:
        furuta.run(rig, io=io, duration=5.0, any_loop=True, **VIRTUAL)
    done = e.value.run
    assert io.volts[-3:] == [0.0] * 3 and done.mode[-1] == "brake" and done.command[-1] == 0
    braking = np.array(done.mode) == "brake"
    assert 0 < braking.sum() * DT <= 0.25 + DT


def test_ctrl_c(interruptible, tmp_path):
    def press(theta, alpha):
        os.kill(os.getpid(), signal.SIGINT)
        return theta, alpha

    log = tmp_path / "run.csv"
    # Pressed again while the motor is being switched off.
    io = Simulated(at={k: press for k in range(300, 310)})
    error = ended(io, error=furuta.Interrupted, log=log)
    assert isinstance(error, KeyboardInterrupt) and "interrupted at t = 0.598 s: motor off" in str(error)
    assert np.array_equal(furuta.Recording(log).alpha, error.run.alpha) and len(error.run) == 300
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_program_that_is_told_to_terminate(tmp_path):
    script = textwrap.dedent(f"""
        import os, signal, sys
        sys.path.insert(0, {str(ROOT / "py/tests")!r})
        import furuta
        from simulated_io import RIG, Simulated

        class Loud(Simulated):
            def exchange(self, volts):
                print(volts, flush=True)
                return super().exchange(volts)

        def stop(theta, alpha):
            os.kill(os.getpid(), signal.SIGTERM)
            return theta, alpha

        furuta.run(RIG, io=Loud(at={{200: stop}}), pace="io", any_clock=True, log="run.csv")
        print("unreachable")
    """)
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 128 + signal.SIGTERM, done.stderr
    assert done.stdout.splitlines()[-3:] == ["0.0"] * 3 and len((tmp_path / "run.csv").read_text()) > 1000


def test_a_pace_that_is_not_the_clocks_is_named():
    # As fast as it can: some thousand samples a second.
    error = ended(Simulated(), 20.0, any_clock=False, late_limit=9.0)
    assert "times as fast as one every 2 ms" in str(error) and "any_clock=True" in str(error)


def test_what_cannot_be_is_refused_before_anything_moves(tmp_path):
    io = Simulated()
    for keywords, error, says in [
        ({"io": object()}, TypeError, "exchange"),
        ({"pace": "mine"}, ValueError, "pace = 'mine'"),
        ({"duration": 0.0}, ValueError, "duration"),
        ({"duration": float("nan")}, ValueError, "duration"),
        ({"dt": 0.0}, furuta.ControllerError, "dt = 0"),
        ({"dt": 0.00123456}, furuta.ControllerError, "microseconds"),
        ({"late_limit": 0.0}, ValueError, "late_limit"),
        ({"arm_steps": 2.0}, ValueError, "arm_steps"),
        ({"log": tmp_path / "run.mcap"}, ValueError, "furuta convert"),
        ({"log": tmp_path / "no" / "run.csv"}, FileNotFoundError, "no folder"),
        ({"log": tmp_path}, IsADirectoryError, "folder"),
    ]:
        with pytest.raises(error, match=says):
            furuta.run(RIG, **({"io": io, "duration": 1.0} | VIRTUAL | keywords))
    assert io.volts == []


def test_a_controller_that_does_not_hold_is_refused():
    io = Simulated()
    turned = furuta.Controller.lqr([0.0, 0.0, 0.0, 0.0], RIG, DT)
    with pytest.raises(furuta.ControllerError, match="does not hold qube-servo-2 upright: .*any_loop=True"):
        furuta.run(RIG, turned, io=io, duration=0.2, **VIRTUAL)
    assert io.volts == []
    assert furuta.run(RIG, turned, io=io, duration=0.2, any_loop=True, **VIRTUAL).end == "finished"


def test_controllers_and_their_files(tmp_path):
    A, B = furuta.linearize(RIG)
    K, _, _ = furuta.lqr(A, B, np.diag([5, 1, 0.1, 0.1]), [[0.1]])
    controller = furuta.Controller.lqr(K, RIG, 0.004)
    controller.save(tmp_path / "own.toml")
    own = furuta.run(RIG, controller, io=Simulated(dt=0.004), duration=2.0, **VIRTUAL)
    assert own.dt == 0.004 and own.samples == 501 and own.mode[-1] == "balance"
    file = furuta.run(RIG, tmp_path / "own.toml", io=Simulated(dt=0.004), duration=2.0, dt=0.004, **VIRTUAL)
    assert np.array_equal(own.command, file.command)


def test_a_log_is_never_replaced_unasked(tmp_path):
    log = tmp_path / "run.csv"
    log.write_text("mine")
    io = Simulated()
    with pytest.raises(FileExistsError, match="force=True"):
        run(io, 0.1, log=log)
    assert io.volts == [] and log.read_text() == "mine"
    done = run(io, 0.1, log=log, force=True)
    assert log.read_text().startswith("# furuta log 1\n")
    with pytest.raises(FileExistsError):
        done.save(log)


def test_a_log_that_cannot_be_written_keeps_the_run(tmp_path):
    log = tmp_path / "run.csv"
    io = Simulated(at={100: lambda *angles: (log.write_text("mine"), angles)[1]})
    error = ended(io, 0.5, log=log)
    assert "the log was not written" in str(error) and len(error.run) == 251 and log.read_text() == "mine"


def test_a_log_is_a_recording(tmp_path):
    log = tmp_path / "run.csv"
    done = run(Simulated(RIG.with_effect("arm.coulomb")), 6.0, arm_steps=0.2, log=log)
    read = furuta.Recording(log)
    assert all(np.array_equal(read[name], getattr(done, name)) for name in ("t", "u", "theta", "alpha"))
    assert np.array_equal(read["alpha_dot"], done.alpha_dot) and np.array_equal(read["delay"], done.lateness)
    found = furuta.diagnose(log, RIG)
    # Dry friction of the arm: which kind of it, six seconds need not say.
    assert found.effects[0]["id"] in ("arm.coulomb", "arm.stribeck", "arm.presliding")


def test_a_log_is_replayed_bit_for_bit(tmp_path):
    for case, (io, keywords) in {
        "angles": (Simulated(), {"arm_steps": 0.2}),
        # What is lost, is bridged in the replay as well.
        "lost": (Simulated(at={5: late(0.1)}), {"pace": "ours", "any_clock": False, "late_limit": 9.0}),
    }.items():
        csv, mcap = tmp_path / f"{case}.csv", tmp_path / f"{case}.mcap"
        done = run(io, 2.0, log=csv, **keywords)
        assert done.replayable
        assert program("convert", csv, mcap).returncode == 0
        again = furuta.replay(mcap)
        assert again.identical and again.samples == done.samples, again.summary()
        columns = again.columns()
        for name in ("t", "command", "theta_dot", "alpha_dot", "reference"):
            assert np.array_equal(columns[name], getattr(done, name))
        assert columns["mode"] == done.mode


def test_angles_that_are_no_counts_are_logged_and_not_replayed(tmp_path):
    class True_(Simulated):
        def exchange(self, volts):
            super().exchange(volts)
            return self.plant.x[0], self.plant.x[1]

    done = run(True_(), 2.0, log=tmp_path / "run.csv")
    assert not done.replayable and furuta.Recording(tmp_path / "run.csv").samples == done.samples
    assert program("convert", tmp_path / "run.csv", tmp_path / "run.mcap").returncode == 0
    with pytest.raises(furuta.RecordingError, match="format"):
        furuta.replay(tmp_path / "run.mcap")


def test_what_held_is_told_to_the_estimator():
    rig = furuta.Rig.load("shahzad2022-srv02")
    told, untold = furuta.Supervisor(rig), furuta.Supervisor(rig)
    for k in range(3):
        told.step(k * DT, 0.0, np.pi, held=0.0)
        untold.step(k * DT, 0.0, np.pi)
    # Without a voltage, nothing is expected to move, beyond how pi is rounded.
    assert np.abs(told.estimate[2:]).max() < 1e-14 and abs(untold.estimate[2]) > 0.01


@pytest.fixture
def quanser(monkeypatch):
    """The simulated card of examples/io, without a clock, and the adapters of the page that is about it."""
    for name in ("quanser", "quanser.hardware"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(str(ROOT / "examples/io"))
    import quanser.hardware as hardware

    monkeypatch.setattr(hardware.HIL, "real_time", False)
    page = (ROOT / "docs/io-from-python.md").read_text()
    names = {"__name__": "page", "hardware": hardware}
    for block in page.split("```python\n")[1:]:
        if (code := block.split("```")[0]).lstrip().startswith(("from array", "class Immediate")):
            exec(code, names)
    yield names
    for name in ("quanser", "quanser.hardware"):
        sys.modules.pop(name, None)


def test_the_documented_adapter_on_a_simulated_card(quanser, tmp_path):
    log = tmp_path / "run.csv"
    with quanser["Qube"]() as qube:
        first = furuta.run(RIG, io=qube, duration=2.0, log=log, **VIRTUAL)
        again = furuta.run(RIG, io=qube, duration=1.0, **VIRTUAL)  # from where the first has ended
        card = qube.card
        assert card._volts == 0.0 and card._enabled
    assert first.mode[-1] == "balance" and again.samples == 501 and not card.is_valid()
    assert first.said["io"].endswith("Qube, pace io, counts") and furuta.Recording(log).samples == 1001


def test_a_card_whose_task_fails_is_switched_off(quanser, monkeypatch):
    hardware = quanser["hardware"]
    read, calls = hardware.HIL.task_read_encoder, []

    def fail(self, *arguments):
        calls.append(1)
        if len(calls) > 100:
            raise hardware.HILError("The card was unplugged.")
        return read(self, *arguments)

    monkeypatch.setattr(hardware.HIL, "task_read_encoder", fail)
    with quanser["Qube"]() as qube:
        with pytest.raises(furuta.RunError, match="raised HILError: The card was unplugged.* motor off"):
            furuta.run(RIG, io=qube, **VIRTUAL)
        assert qube.card._volts == 0.0


def test_the_immediate_adapter(quanser, monkeypatch):
    monkeypatch.setattr(quanser["hardware"].HIL, "real_time", True)
    with quanser["Immediate"]() as qube:
        done = furuta.run(RIG, io=qube, duration=1.0, late_limit=3.0)
    assert done.end == "finished" and np.abs(done.theta).max() > 0.1


def test_a_card_that_is_not_enabled_is_found(quanser, monkeypatch):
    monkeypatch.setattr(quanser["hardware"].HIL, "write_digital", lambda *_: None)
    with quanser["Qube"]() as qube, pytest.raises(furuta.RunError, match="see .* that the amplifier is enabled"):
        furuta.run(RIG, io=qube, **VIRTUAL)


def test_runs_are_equal_that_have_the_same_numbers():
    one, again = run(Simulated(), 0.2), run(Simulated(), 0.2)
    again = dataclasses.replace(
        again, lateness=one.lateness.copy(), compute=one.compute.copy(), exchange=one.exchange.copy(), said=one.said
    )
    assert one == again and one != dataclasses.replace(again, u=again.u + 1) and one != "a run"
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)
