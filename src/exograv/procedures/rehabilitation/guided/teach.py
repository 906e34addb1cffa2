"""Teaching of a path: a floating arm is led once by hand, and its motion is kept."""

from collections.abc import Callable

import numpy as np

from exograv.loop.tick_sample import TickSample

from .floating_arm import FloatingArm
from .path_shaping import ShapedPath, shaped

SAMPLE_S = 0.01
"""Time between two recorded postures [s]."""


def teach(flown: FloatingArm, seconds: float, act: Callable[[], object] = lambda: None) -> ShapedPath:
    """Let the arm float for `seconds` while a therapist leads it, and return the shaped path.

    Args:
        flown: Arm, floating.
        seconds: Time for the therapist [s].
        act: Called in every tick, to act beside the machine.

    Raises:
        ConfigError: The motion is too small or too long, or leaves the range of machine and person.
        RigError: The envelope stopped the run.
    """
    dt = flown.pilot.rig.period_s
    every, rows, ticks = round(SAMPLE_S / dt), [], 0
    flown.pilot.begin("teach")

    def listen(moment: TickSample) -> None:
        nonlocal ticks
        act()
        if ticks % every == 0:
            rows.append(moment.q.copy())
        ticks += 1

    flown.run(seconds, "The arm floats; lead it", listen)
    assembly = flown.controller.assembly
    return shaped(np.array(rows), every * dt, assembly.description, assembly.exo)
