"""Ramps between modes of the controller. The wearer would feel a step as a push."""

from collections.abc import Callable
from typing import Literal

import numpy as np
from jaxtyping import Float

from exograv import motion

from .arm_controller import ArmController
from .output_feedback import Guide
from .phases import RAMPS_S
from .pilot import Pilot
from .tick_sample import TickSample


class _Fade:
    """Ramp of one field of the controller's mode, by a small step every tick."""

    def __init__(self, pilot: Pilot, controller: ArmController, field: str, goal: float, ticks: int):
        self._envelope = pilot.envelope
        self._mode, self._field, self._goal = controller.mode, field, goal
        self._step = (goal - getattr(self._mode, field)) / ticks
        self._left = ticks

    def __call__(self, _moment: TickSample) -> None:
        self._left -= 1
        value = self._goal if self._left <= 0 else getattr(self._mode, self._field) + self._step
        setattr(self._mode, self._field, value)
        person = self._envelope.person
        if person is not None and self._field == "gravity_level":
            person.gravity_level = value
        elif person is not None:
            person.drive(value > 0.0)


def fade(
    pilot: Pilot,
    controller: ArmController,
    field: Literal["drive", "gravity_level"],
    goal: float,
    posture: Float[np.ndarray, " joint"],
    guide: Guide | None = None,
    listener: Callable[[TickSample], None] = lambda _moment: None,
) -> None:
    """Bring a field of the controller's mode to `goal` while the controller holds `posture` [rad] or follows a guide.

    Return at once if the field has this value already. The listener receives every tick of the ramp.

    Raises:
        RigError: The envelope stopped the run.
    """
    if getattr(controller.mode, field) == goal:
        return
    dt = pilot.rig.period_s
    change = _Fade(pilot, controller, field, goal, round(RAMPS_S[field] / dt))
    text = "Letting go" if goal == 0.0 else "Taking over"

    def listen(moment: TickSample) -> None:
        change(moment)
        listener(moment)

    pilot.run(controller, motion.hold(posture, RAMPS_S[field], dt), text, listen, guide)
