"""Flies the passes and keeps what was measured in them, each sample with the posture that it belongs to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exograv import motion
from exograv.identification.core.interface import Sample
from exograv.identification.core.sample_filter import SampleFilter
from exograv.identification.core.sample_pace import Averages
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.phases import ON_THE_WAY, TRAVEL_RAD_S, VERIFICATION
from exograv.loop.pilot import Pilot, TickSample

from .postures import ROUNDS, SPEED_RAD_S, Joints, Postures, visits

SAMPLE_S = 0.25
"""That a kept sample is the mean of [s]: in a pass gears' ripple turns about once, and cancels."""

SLIDING = 0.6
"""Share of a pass's speed from which on a joint is asked to move for sure in one direction [-]."""


@dataclass(frozen=True)
class PassSample:
    """One sample, in the pass of one posture."""

    posture: int
    sample: Sample


class PassListener:
    """Filters without a break and keeps the means of the passes."""

    def __init__(self, joints: int, dt: float):
        self._filter = SampleFilter(joints, dt)
        self._averages = Averages(SAMPLE_S)
        self.posture: int | None = None
        """Whose pass it is; None on the way to one."""
        self.heard: list[PassSample] = []

    def begin(self, posture: int | None) -> None:
        """What follows belongs to this posture, or to none."""
        self.posture, self._averages = posture, Averages(SAMPLE_S)

    def interrupt(self) -> None:
        """Ticks are missing: what comes next follows on nothing."""
        self._filter.restart()
        self.begin(self.posture)

    def __call__(self, moment: TickSample) -> None:
        """One tick."""
        self.take(moment.state.q, moment.tau_measured, moment.reference.q)

    def take(self, q: Joints, tau: Joints, q_asked: Joints) -> None:
        """One tick: position [rad] and torque [N·m] as measured, position that was asked for [rad]."""
        sample = self._filter.update(q, tau, q_asked)
        if self.posture is None or not self._filter.settled:
            return
        mean = self._averages.take(sample)
        # Near the turns friction helps nobody knows whom. A joint that a person holds back is told by its own speed.
        if mean is not None and mean.asked is not None and (np.abs(mean.asked.v) > SLIDING * SPEED_RAD_S).all():
            self.heard.append(PassSample(self.posture, mean))


def fly_passes(pilot: Pilot, controller: ArmController, postures: Postures, seed: int) -> Sequence[PassSample]:
    """Bring the arm to each posture and past it in both directions, carried and driven weakly.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt = pilot.rig.period_s
    pilot.begin(ON_THE_WAY)
    fade(pilot, controller, "drive", VERIFICATION.drive.goal(is_known=True), pilot.q.copy())
    fade(pilot, controller, "gravity_level", 0.0, pilot.q.copy())
    listener = PassListener(postures.shape[1], dt)
    for visit, (k, path) in enumerate(visits(postures, seed, dt)):
        text = f"Verifying: pass {visit + 1} of {ROUNDS * len(postures)}"
        listener.begin(None)
        pilot.begin(ON_THE_WAY)
        pilot.run(controller, motion.go_to(pilot.q, path.q[0], TRAVEL_RAD_S, dt), text, listener)
        listener.begin(k)
        pilot.begin(VERIFICATION)
        pilot.run(controller, path, text, listener)
    return listener.heard
