"""Flight of the passes, and collection of their samples by posture."""

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
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample

from .postures import ROUNDS, SPEED_RAD_S, Joints, Postures, visits

SAMPLE_S = 0.25
"""Averaging time of a stored sample [s]. During a pass the gears' ripple turns about once in it and cancels."""

SLIDING = 0.6
"""Share of a pass's speed from which the direction of a joint's reference is certain [-]."""


@dataclass(frozen=True)
class PassSample:
    """Sample in the pass of one posture."""

    posture: int
    sample: Sample


class PassListener:
    """Listener that filters all ticks and stores the averaged samples of the passes."""

    def __init__(self, joints: int, dt: float):
        self._filter = SampleFilter(joints, dt)
        self._averages = Averages(SAMPLE_S)
        self.posture: int | None = None
        """Posture of the present pass; None between passes."""
        self.heard: list[PassSample] = []

    def begin(self, posture: int | None) -> None:
        """Assign the following ticks to this posture, or to none."""
        self.posture, self._averages = posture, Averages(SAMPLE_S)

    def interrupt(self) -> None:
        """Restart the filter after missing ticks."""
        self._filter.restart()
        self.begin(self.posture)

    def __call__(self, moment: TickSample) -> None:
        """Collect the sample of one tick."""
        self.take(moment.state.q, moment.tau_measured, moment.reference.q)

    def take(self, q: Joints, tau: Joints, q_asked: Joints) -> None:
        """Take measured position [rad], measured torque [N·m] and reference position [rad] of one tick."""
        sample = self._filter.update(q, tau, q_asked)
        if self.posture is None or not self._filter.settled:
            return
        mean = self._averages.take(sample)
        # Near the turns the direction of friction is uncertain. A joint that a person holds back has its direction from
        # its measured speed.
        if mean is not None and mean.asked is not None and (np.abs(mean.asked.v) > SLIDING * SPEED_RAD_S).all():
            self.heard.append(PassSample(self.posture, mean))


def fly_passes(pilot: Pilot, controller: ArmController, postures: Postures, seed: int) -> Sequence[PassSample]:
    """Move the arm through each posture in both directions, carried and driven weakly, and return the samples.

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
