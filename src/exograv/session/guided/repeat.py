"""A taught path, repeated: the arm is led to its beginning and along it, so often, unless its owner wants otherwise."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from exograv import motion
from exograv.motion import Trajectory
from exograv.session.pilot import Moment

from .flown import Flown, rms_deg
from .path_guide import DROP_S, GRIP_S, Led, PathGuide
from .pull import Strength

APPROACH_RAD_S = 0.4
"""On the way to where the path begins, and back from its end."""

PATIENCE_S = 60.0
"""Beyond the time that the path takes: who holds against it for longer in all is let go."""

REST_S = 1.0
"""At the end of a path, before it is judged or repeated."""


@dataclass
class Repeated:
    """What came of a session."""

    repetitions: int = 0
    """That were led to their end."""
    state: Led = Led.FREE
    waited_s: float = 0.0
    pull_max: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Largest torque of the pull a joint [N·m]."""
    errors: list[np.ndarray] = field(default_factory=list)
    """From the path while it was repeated, by the machine's encoders, a tick [rad]."""

    @property
    def figures(self) -> dict[str, Any]:
        """For `--json`."""
        return {
            "repetitions": self.repetitions,
            "outcome": self.state.value,
            "tracking_rms_deg": rms_deg(self.errors),
            "waited_s": round(self.waited_s, 2),
            "pull_max_Nm": self.pull_max.round(3).tolist(),
        }


def repeat(
    flown: Flown,
    path: Trajectory,
    speed: float,
    repetitions: int,
    act: Callable[[PathGuide], None] = lambda _guide: None,
) -> Repeated:
    """Lead the floating arm to the path and along it, `repetitions` times; it floats afterwards, whatever happened.

    Args:
        flown: The arm, floating.
        path: As fast as it may be driven.
        speed: Share of its own speed, 0.1 to 1.
        repetitions: At least 1.
        act: Called in every tick: whoever acts beside the machine, and may let go.

    Raises:
        RigError: The envelope stopped the run.
    """
    pilot, strength = flown.pilot, Strength.of(flown.controller.assembly.description)
    done = Repeated(pull_max=np.zeros(len(pilot.q)))
    for number in range(repetitions):
        is_first, dt = number == 0, pilot.rig.period_s
        pilot.begin("go to the path")
        way = motion.go_to(pilot.q, path.q[0], APPROACH_RAD_S, dt)
        if not _along(flown, way, 1.0, strength, act, done, is_first, counts=False):
            break
        pilot.begin(f"repeat {number + 1}")
        if not _along(flown, path, speed, strength, act, done, False, counts=True):
            break
        done.repetitions += 1
    flown.pilot.begin("float")
    guide = PathGuide(motion.hold(pilot.q, 1.0, pilot.rig.period_s), strength, 1.0)
    if flown.controller.mode.drive > 0.0:
        flown.float_again(guide)
    return done


def _along(
    flown: Flown,
    way: Trajectory,
    speed: float,
    strength: Strength,
    act: Callable[[PathGuide], None],
    done: Repeated,
    is_first: bool,
    counts: bool,
) -> bool:
    """One way, to its end; whether the person went along."""
    guide = PathGuide(way, strength, speed)
    if is_first:
        flown.lead(guide)
    else:
        # The pull is there already: it goes on holding the arm where the last way has ended.
        guide.grip = 1.0
    guide.lead()

    def listen(moment: Moment) -> None:
        act(guide)
        np.maximum(done.pull_max, np.abs(guide.tau), out=done.pull_max)
        if counts and guide.state is Led.LED:
            done.errors.append(guide.target - moment.q)

    seconds = way.seconds / speed + PATIENCE_S + GRIP_S
    text = "Repeating the path" if counts else "Going to where the path begins"
    in_time = flown.run(seconds, text, listen, guide, lambda: guide.has_let_go or guide.state is Led.ARRIVED)
    if in_time and guide.state is Led.ARRIVED:
        flown.run(REST_S, text, listen, guide, lambda: guide.has_let_go)
    else:
        guide.let_go()
        flown.run(2.0 * DROP_S, "Letting go", listen, guide)
    done.state, done.waited_s = guide.state, done.waited_s + guide.waited_s
    return guide.state is Led.ARRIVED
