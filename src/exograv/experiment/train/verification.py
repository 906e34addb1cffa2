"""Verification between two windows: residual torque of the arm's weight while the participant relaxes."""

from dataclasses import fields

import numpy as np

from exograv.errors import ConfigError
from exograv.identification.core.interface import Estimate
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.phases import VERIFICATION
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.verification.figures import verified_figures
from exograv.procedures.verification.verification import verify_arm

from .preparation import Ready, VerifiedBetween, lay_down

SEEN_EVERY = 50
"""Number of ticks between two postures of the identification that count as seen."""


def verify_between(ready: Ready, seed: int, after_windows: int) -> VerifiedBetween:
    """Take the arm from its support, run the verification passes, and lay it down again.

    Args:
        ready: Machine that carries an arm, at gravity level 1.
        seed: Seed of the postures.
        after_windows: Complete windows so far.

    Raises:
        ConfigError: The machine only records.
        RigError: The envelope stopped the run.
    """
    pilot, controller, person = ready.pilot, ready.controller, ready.person
    if not isinstance(controller, ArmController) or ready.model is None or person is None:
        raise ConfigError(
            "--verify-every needs a machine that carries the arm; this one only records. Omit the option."
        )
    ready.put_room(False)
    pilot.begin(VERIFICATION)
    posture = pilot.q.copy()
    fade(pilot, controller, "gravity_level", 0.0, posture)
    fade(pilot, controller, "drive", VERIFICATION.drive.goal(is_known=True), posture)
    arm = Estimate(MOTION_S, np.array(person.x), np.array(person.covariance), 0.0, 1.0)
    seen = identification_motion(controller.assembly, MOTION_S, SEEN_EVERY * pilot.rig.period_s).q
    verified = verify_arm(pilot, controller, ready.model, arm, seen, seed)
    figures = verified_figures(verified, pilot.rig.joints)
    lay_down(pilot, controller, ready.put_room)
    kept = [one.name for one in fields(VerifiedBetween) if one.name != "after_windows"]
    return VerifiedBetween(after_windows, **{name: getattr(figures, name) for name in kept})
