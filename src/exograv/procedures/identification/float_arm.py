"""Floating phase: the arm floats at the wanted gravity level, without a reference, and its drift is measured."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Covariance
from exograv.loop.arm_controller import ArmController
from exograv.loop.drift_monitor import DriftMonitor
from exograv.loop.mode_ramp import fade
from exograv.loop.phases import FLOATING, ON_THE_WAY, Phase
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample

from .identify import SKELETON_TICKS, record_skeleton


@dataclass(frozen=True)
class Drift:
    """Drift of the floating arm."""

    drift_deg: Float[np.ndarray, " joint"]
    """Largest distance from the posture of release [°]."""

    window_s: float


def float_arm(
    pilot: Pilot,
    controller: ArmController,
    posture: Float[np.ndarray, " joint"],
    gravity_level: float,
    window_s: float,
    phase: Phase | str = FLOATING,
    covariance: Covariance | None = None,
    model: ArmModel | None = None,
) -> Drift:
    """Bring the arm to a posture [rad], release it, and watch it for `window_s`, also by the drift monitor.

    Args:
        pilot: Pilot of the machine.
        controller: Controller that carries the arm.
        posture: Posture of release [rad].
        gravity_level: Felt share of the arm's weight [-].
        window_s: Duration of the watch [s].
        phase: Name of the watch in the recording.
        covariance: Covariance of the arm's parameters; None for the arm of the body-segment table.
        model: Model of this arm in this machine, for the drift monitor; made anew if absent.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt = pilot.rig.period_s
    pilot.begin(ON_THE_WAY)
    fade(pilot, controller, "drive", ON_THE_WAY.drive.goal(is_known=True), pilot.q.copy())
    pilot.run(controller, FLOATING.approach(pilot.q, posture, dt), "Moving to the posture of release")
    fade(pilot, controller, "gravity_level", gravity_level, posture)
    fade(pilot, controller, "drive", FLOATING.drive.goal(is_known=True), posture)
    pilot.begin(phase)
    start = pilot.q.copy()
    farthest = np.zeros_like(start)
    ticks = 0

    def watch(moment: TickSample) -> None:
        nonlocal ticks
        np.maximum(farthest, np.abs(moment.state.q - start), out=farthest)
        ticks += 1
        if ticks % SKELETON_TICKS == 0:
            record_skeleton(pilot, controller, moment)

    pilot.drift = DriftMonitor(controller, covariance, dt, model)
    pilot.run(controller, motion.hold(start, window_s, dt), f"Floating at gravity level {gravity_level:g}", watch)
    pilot.drift = None
    return Drift(np.rad2deg(farthest), window_s)
