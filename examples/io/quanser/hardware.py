"""`HIL`, `Clock` and `HILError`: the calls that docs/io-from-python.md uses, with a simulated QUBE-Servo 2 behind them.

The encoders count from where the rig rests, the motor obeys once digital output 0 is on, a task reads the encoders at
its frequency into a buffer, and reading from it waits for the next sample. `HIL.real_time = False` lets no clock pass:
a sample is there as soon as it is asked for.
"""

from __future__ import annotations

import math
import time
from collections.abc import MutableSequence, Sequence
from typing import Any, ClassVar

import furuta

STEP = 0.0005
"""Time step of the simulation, s."""


class HILError(Exception):
    """What the calls raise."""

    def get_error_message(self) -> str:
        """The error in words."""
        return str(self)


class Clock:
    """Clocks of a card."""

    HARDWARE_CLOCK_0 = 0
    SYSTEM_CLOCK_1 = -1


class HIL:
    """A card with a QUBE-Servo 2.

    Analog output 0 is the motor's voltage, digital output 0 enables the motor, encoders 0 and 1 are the arm's and the
    pendulum's.
    """

    INFINITE = -1

    rig: ClassVar[furuta.Rig] = furuta.Rig.load("qube-servo-2").with_parameters(
        {"arm.viscous": 3e-4, "pendulum.viscous": 5e-5}
    )
    """The rig behind the card: with less friction than the built-in file, whose motor cannot swing it up."""
    real_time: ClassVar[bool] = True
    """Whether time passes as on a clock."""

    def __init__(self, card_type: str | None = None, card_identifier: str | None = None) -> None:
        self._plant: furuta.Simulator | None = None
        if card_type is not None:
            self.open(card_type, card_identifier or "0")

    def open(self, card_type: str, card_identifier: str) -> None:
        """Switches the rig on, its pendulum hanging at rest."""
        if card_type != "qube_servo2_usb":
            raise HILError(f"no card of type {card_type!r} is simulated")
        self._plant = furuta.Simulator(self.rig, [0, math.pi, 0, 0], STEP)
        self._volts, self._enabled = 0.0, False
        self._zero = [0, 0]
        self._task: dict[str, Any] | None = None
        self._opened = time.perf_counter()

    def is_valid(self) -> bool:
        """Whether the card is open."""
        return self._plant is not None

    def close(self) -> None:
        """Closes the card; what it held at its outputs, it holds."""
        self._plant = None

    def write_analog(self, channels: Sequence[int], num_channels: int, buffer: Sequence[float]) -> None:
        """Sets the motor's voltage."""
        self._pass(self._now())
        self._volts = float(buffer[list(channels[:num_channels]).index(0)])

    def write_digital(self, channels: Sequence[int], num_channels: int, buffer: Sequence[int]) -> None:
        """Enables the motor."""
        self._pass(self._now())
        self._enabled = bool(buffer[list(channels[:num_channels]).index(0)])

    def set_encoder_counts(self, channels: Sequence[int], num_channels: int, buffer: Sequence[int]) -> None:
        """Sets what encoders read now."""
        raw = self._raw()
        for channel, count in zip(channels[:num_channels], buffer):
            self._zero[channel] = raw[channel] - count

    def read_encoder(self, channels: Sequence[int], num_channels: int, buffer: MutableSequence[int]) -> None:
        """Reads encoders at once."""
        self._pass(self._now())
        self._read(channels[:num_channels], buffer)

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Sequence[int], num_channels: int) -> object:
        """A task that reads encoders."""
        self._open()
        self._task = {"channels": list(channels[:num_channels]), "buffer": samples_in_buffer}
        return self._task

    def task_start(self, task: Any, clock: int, frequency: float, num_samples: int) -> None:
        """From now on the task reads, this number of times a second."""
        task |= {"period": 1 / frequency, "next": self._open().t + 1 / frequency}

    def task_read_encoder(self, task: Any, num_samples: int, buffer: MutableSequence[int]) -> int:
        """The next sample of the task; waits for it."""
        if task is not self._task or "next" not in task:
            raise HILError("The task is not running.")
        if num_samples != 1:
            raise HILError("One sample at a time is simulated.")
        due = task["next"]
        if self.real_time:
            if (self._now() - due) / task["period"] > task["buffer"]:
                raise HILError("The task's buffer overflowed.")
            time.sleep(max(due - self._now(), 0.0))
        task["next"] = due + task["period"]
        self._pass(due)
        self._read(task["channels"], buffer)
        return 1

    def task_stop(self, task: Any) -> None:
        """The task reads no more."""
        task.pop("next", None)

    def task_delete(self, task: Any) -> None:
        """Frees the task."""
        self._task = None

    def _open(self) -> furuta.Simulator:
        if self._plant is None:
            raise HILError("The card is not open.")
        return self._plant

    def _now(self) -> float:
        return time.perf_counter() - self._opened if self.real_time else self._open().t

    def _pass(self, until: float) -> None:
        """Lets the simulation go on, the motor held at its voltage."""
        plant = self._open()
        while plant.t + STEP <= until + 1e-9:
            plant.step(self._volts if self._enabled else 0.0)

    def _raw(self) -> list[int]:
        theta, alpha = self._open().reading
        per_turn = self.rig.sensors
        return [
            round(theta * per_turn["arm_counts_per_rev"] / math.tau),
            round((alpha - math.pi) * per_turn["pendulum_counts_per_rev"] / math.tau),
        ]

    def _read(self, channels: Sequence[int], buffer: MutableSequence[int]) -> None:
        raw = self._raw()
        for place, channel in enumerate(channels):
            buffer[place] = raw[channel] - self._zero[channel]
