"""Teaching of a path: a floating arm is led once by hand, and its motion is kept."""

from collections.abc import Callable

import numpy as np

from exograv.loop.floating_machine import LOOK_S, FloatingMachine
from exograv.loop.tick_sample import Joints
from exograv.model.assembly import Assembly

from .path_shaping import SHORTEST_RAD, STARTS_RAD, ShapedPath, shaped

STILL_S = 3.0
"""Time without motion, after a motion, that ends the teaching of a person in a machine on drives [s]."""

Done = Callable[[float, Joints], bool]
"""Function of the time [s] and the joint positions [rad] that returns True to end the teaching."""


def teach(
    machine: FloatingMachine, assembly: Assembly, seconds: float, is_done: Done = lambda _t, _q: False
) -> ShapedPath:
    """Let the arm float for `seconds` while a therapist leads it, and return the shaped path.

    Args:
        machine: Machine in which the arm floats.
        assembly: The machine with the arm in it.
        seconds: Longest time for the therapist [s].
        is_done: Called every `LOOK_S`; True to end earlier.

    Raises:
        ConfigError: The motion is too small or too long, or leaves the range of machine and person.
        RigError: The machine was stopped.
    """
    times, rows = [machine.t], [machine.q.copy()]

    def look(t: float, q: Joints) -> bool:
        times.append(t)
        rows.append(q.copy())
        return is_done(t, q)

    machine.begin("teach")
    machine.float_for(seconds, look)
    # A live machine is looked at when its messages arrive, which is not at even times.
    t = np.arange(times[0], times[-1], LOOK_S)
    q = np.column_stack([np.interp(t, times, column) for column in np.array(rows).T])
    return shaped(q, LOOK_S, assembly.description, assembly.exo)


class StillAfterMotion:
    """Test that is True when the arm was moved and has then been still for `STILL_S`."""

    def __init__(self) -> None:
        self._first: Joints | None = None
        self._held, self._since, self._has_moved = np.zeros(0), 0.0, False

    def __call__(self, t: float, q: Joints) -> bool:
        """Take a posture [rad] at a time [s]."""
        if self._first is None:
            self._first, self._held, self._since = q.copy(), q.copy(), t
        self._has_moved = self._has_moved or float(np.abs(q - self._first).max()) > SHORTEST_RAD
        if float(np.abs(q - self._held).max()) > STARTS_RAD:
            self._held, self._since = q.copy(), t
        return self._has_moved and t - self._since >= STILL_S
