"""The relay's gain and period by the linear model, sampled here by SciPy; preview and rate of `kind = "mpc"`."""

import numpy as np
import pytest
from scipy import linalg, optimize

import furuta

H = 0.002


def ultimate(rig: furuta.Rig, phase: float) -> tuple[float, float]:
    """Where the sampled loop from command to the pendulum's angle, a sample late, turns by half a turn less `phase`."""
    a, b = furuta.linearize(rig)
    block = np.zeros((5, 5))
    block[:4, :4], block[:4, 4] = a, np.ravel(b)
    held = linalg.expm(block * H)

    def loop(w: float) -> complex:
        z = np.exp(1j * w * H)
        return np.linalg.solve(z * np.eye(4) - held[:4, :4], held[:4, 4])[1] / z * np.exp(1j * phase)

    w = optimize.brentq(lambda w: loop(w).imag, 25, 200)
    return -1 / loop(w).real, 2 * np.pi / w


@pytest.mark.parametrize("name", ["qube-servo-2", "shahzad2022-srv02", "fong2014-emecs", "ramos-velasco"])
def test_ultimate_gain_and_period(name):
    rig = furuta.Rig.load(name)
    found = furuta.relay(rig)
    assert found["model"] == pytest.approx(ultimate(rig, 0), rel=1e-6)
    gain, period = ultimate(rig, found["phase"])
    assert found["ultimate_gain"] == pytest.approx(gain, rel=0.03)
    assert found["ultimate_period"] == pytest.approx(period, rel=0.03)
    assert found["margins"]["stable"]
    # The gains of a controller file hold the rig.
    pendulum, arm = (list(map(float, found[key])) for key in ("pendulum_gains", "arm_gains"))
    text = f'[controller]\nkind = "pid"\npendulum = {pendulum}\narm = {arm}\n'
    control = furuta.Controller.from_toml(text, rig, dt=H)
    x = furuta.simulate(rig, [0, 0.02, 0, 0], np.zeros(3000), H, controller=control, ideal=True)[0]
    assert abs(x[-1, 1]) < 1e-2


@pytest.mark.parametrize("stiffness", [0.01, 0.02, 0.04])
def test_gains_hold_the_spring_that_the_rig_file_names(stiffness):
    """Without it in the gains the loop grows from 0.01 N m/rad on. The poles are NumPy's, without a delay."""
    rig = furuta.Rig.load("qube-servo-2").with_effect("arm.spring", stiffness=stiffness, rest=0.0)
    found = furuta.relay(rig)
    assert found["margins"]["stable"]
    (kp, _, kd), (arm_kp, arm_ki, arm_kd) = found["pendulum_gains"], found["arm_gains"]
    a, b = furuta.zero_order_hold(*furuta.linearize(rig), H)
    gain = np.array([[kp * arm_kp, kp, kp * arm_kd, kd, kp * arm_ki]])
    integral = np.block([[a, np.zeros((4, 1))], [H * np.eye(1, 5)]])
    poles = np.linalg.eigvals(integral - np.vstack([b, [[0]]]) @ gain)
    assert np.abs(poles).max() < 1
    free = furuta.relay("qube-servo-2")["arm_gains"][0]
    assert arm_kp < free


def test_gains_that_let_the_rig_fall_are_refused():
    rig = furuta.Rig.load("qube-servo-2").with_effect("motor.delay", delay=0.01)
    with pytest.raises(furuta.DesignError, match=r"the linear loop grows by .* 1/s \(the rig has motor.delay\)"):
        furuta.relay(rig)


def test_mistakes_are_named():
    rig = furuta.Rig.load("qube-servo-2")
    with pytest.raises(furuta.DesignError, match="amplitude = 20 V"):
        furuta.relay(rig, amplitude=20)
    with pytest.raises(furuta.DesignError, match="16 periods within"):
        furuta.relay(rig, time_limit=0.3)
    with pytest.raises(furuta.DesignError, match="never turns by just half a turn"):
        furuta.relay("stepper-kit")


def test_a_table_ahead_moves_the_command_before_the_reference():
    rig = furuta.Rig.load("qube-servo-2")
    table = np.where(np.arange(100) < 40, 0, 0.4)
    commands = []
    for preview in ("true", "false"):
        text = f'[controller]\nkind = "mpc"\npreview = {preview}\ncommand_rate = 100.0\n'
        mpc = furuta.Controller.from_toml(text, rig, dt=H)
        commands.append([mpc.update(np.zeros(4), ahead=table) for _ in range(3)])
    known, blind = commands
    assert blind == [0, 0, 0]
    assert known[0] != 0
    assert np.abs(np.diff([0, *known])).max() <= 0.2 * (1 + 1e-12)
    with pytest.raises(furuta.ControllerError, match=r"ahead\[1\] = NaN is not a finite number"):
        mpc.update(np.zeros(4), ahead=[0, np.nan])


def test_a_delay_is_not_counted_twice():
    rig = furuta.Rig.load("qube-servo-2")
    text = '[controller]\nkind = "mpc"\ndelay = "motor"\n'
    with pytest.raises(furuta.ControllerError, match="twice"):
        furuta.Controller.from_toml(text, rig, dt=H)
    late = furuta.Controller.from_toml(text + "[estimator]\npredict = false\n", rig, dt=H)
    assert late.kind == "mpc"


def test_orders_beyond_seven():
    rig = furuta.Rig.load("qube-servo-2")
    low = furuta.steady_motion(rig, 4.0, order=7)
    high = furuta.steady_motion(rig, 4.0, order=11)
    assert low[0].shape == (8, 8)
    assert high[0].shape == (12, 12)
    for few, many in zip(low, high, strict=True):
        total = np.add.outer(np.arange(8), np.arange(8))
        np.testing.assert_array_equal(few[total <= 7], many[:8, :8][total <= 7])
    for order in (0, 16):
        with pytest.raises(furuta.DesignError, match="1 to 15"):
            furuta.steady_motion(rig, 4.0, order=order)
