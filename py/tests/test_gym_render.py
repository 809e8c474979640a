"""Pictures of the Gymnasium environment: its interface, what is where in them, one for each rig of many."""

from __future__ import annotations

import sys
import warnings

import furuta
import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("matplotlib")

import furuta.gym  # noqa: E402
from furuta._scene import NEAR, RIGHT, UP, Scene, points, reach  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

ID = "furuta/RotaryPendulum-v0"
RIG = furuta.Rig.load("qube-servo-2")


def test_gymnasiums_own_check_has_nothing_to_say():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ID, render_mode="rgb_array").unwrapped)


def test_a_picture_a_command():
    env = gymnasium.make(ID, render_mode="rgb_array", rate=50.0)
    assert env.unwrapped.metadata["render_fps"] == 50 and env.unwrapped.render_mode == "rgb_array"
    env.reset(seed=1)
    before = env.render()
    assert before.shape == (400, 400, 3) and before.dtype == np.uint8 and before.max() == 255
    for _ in range(10):
        env.step(np.array([1.0], dtype=np.float32))
    assert (env.render() != before).any() and (env.render() == env.render()).all()


def red(pixels) -> np.ndarray:
    """Where the pendulum is: pixels right and above of the middle."""
    r, g, b = (pixels[..., k].astype(int) for k in range(3))
    rows, columns = np.nonzero((r > 180) & (g < 80) & (b < 80))
    middle = (pixels.shape[0] - 1) / 2
    return np.column_stack([columns - middle, middle - rows])


@pytest.mark.parametrize("theta", [0.0, 1.0, -1.5])
@pytest.mark.parametrize("alpha", [0.0, 0.7, np.pi, -2.0])
def test_the_pendulum_is_where_it_should_be(theta, alpha):
    """The red pixels lie about the middle of the rod as mechanics has it."""
    seen = red(Scene().draw(RIG, np.array([theta, alpha, 0, 0])))
    joint, tip = points(RIG, theta, alpha)
    per_pixel = 2 * reach(RIG) / 400
    ends = np.array([[RIGHT @ p, UP @ p] for p in (joint, tip)]) / per_pixel
    # Of the rod some is hidden by the hinge and, behind it, by the post.
    away = ends[1] - ends[0]
    share = (seen - ends[0]) @ away / (away @ away)
    aside = np.abs((seen - ends[0]) @ [-away[1], away[0]]) / np.linalg.norm(away)
    assert aside.max() < 6 and 0.95 < share.max() < 1.3 and len(seen) > 30
    assert np.isclose(np.linalg.norm(tip - joint), 2 * RIG["pendulum.com"])


@pytest.mark.parametrize("reference", [-2.0, 0.0, 0.5, 2.5])
def test_the_reference_is_seen(reference):
    pixels = Scene().draw(RIG, np.array([reference + 1.5, np.pi, 0, 0]), reference).astype(int)
    rows, columns = np.nonzero((pixels[..., 1] > 130) & (pixels[..., 0] < 90) & (pixels[..., 2] < 90))
    place = RIG["arm.length"] * np.array([np.cos(reference), np.sin(reference), 0])
    expected = np.array([RIGHT @ place, UP @ place]) / (2 * reach(RIG) / 400)
    assert np.allclose([columns.mean() - 199.5, 199.5 - rows.mean()], expected, atol=6)


def test_the_directions_are_those_of_the_exported_model():
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(RIG.to_mjcf())
    data = mujoco.MjData(model)
    data.qpos[:] = 0.4, 2.2
    mujoco.mj_forward(model, data)
    joint, tip = points(RIG, 0.4, 2.2)
    body = model.body("pendulum").id
    assert np.allclose(data.xpos[body], joint, atol=1e-12)
    assert np.allclose(data.xipos[body] - joint, (tip - joint) / 2, atol=1e-9)
    assert np.allclose(np.array([RIGHT, UP, NEAR]) @ np.array([RIGHT, UP, NEAR]).T, np.eye(3))


def test_a_picture_of_each_of_many():
    many = gymnasium.make_vec(ID, num_envs=3, render_mode="rgb_array", randomize={"pendulum.com": 0.2})
    many.reset(seed=1)
    pictures = many.render()
    assert len(pictures) == 3 and all(picture.shape == (400, 400, 3) for picture in pictures)
    assert (pictures[0] != pictures[1]).any()


def test_what_cannot_be_shown(monkeypatch):
    with pytest.raises(ValueError, match="none of None, \"rgb_array\"; for a window: .*HumanRendering"):
        furuta.gym.RotaryPendulum(render_mode="human")
    env = furuta.gym.RotaryPendulum(render_mode="rgb_array")
    env.reset(seed=1)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match=r'pip install "furuta\[plot\]"'):
        env.render()
