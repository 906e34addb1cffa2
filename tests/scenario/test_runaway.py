"""A motor that suddenly turns the wrong way throws the arm until its own drive brakes it. Damping would not.

The current does not show the fault. A drive's brake is the shorted motor, which has no sign.
"""

import numpy as np
import pytest

from exograv import motion
from exograv.errors import RigError
from exograv.safety.stops import StopReason

SHOULDER = 0

BRAKED_TICKS = 50
"""Ticks after which the drive must have braked the throw."""

SINKING_M_S = 0.74
"""Speed of a hand that only damping lets down (docs/explanation/safety.md)."""


@pytest.mark.slow
def test_a_motor_that_turns_the_other_way_ends_in_its_own_drive_s_brake_and_a_slow_hand(put_on, monkeypatch):
    worn, hand = put_on(), []
    twin, pilot = worn.twin, worn.pilot
    raised = np.deg2rad([60.0, 20.0, 0.0, 80.0])
    worn.controller.mode.drive = 1.0
    pilot.run(worn.controller, motion.go_to(pilot.q, raised, 0.8, twin.period_s), "Raising the arm")
    worn.controller.mode.drive = 0.0
    read, write, other = twin.read, twin.write, np.where(np.arange(4) == SHOULDER, -1.0, 1.0)

    def wrote(command):
        write(command._replace(current=other * command.current))
        if pilot.envelope.stop is not None:
            hand.append(twin.hand_speed())

    twin.turn_motor(SHOULDER, -1.0)
    monkeypatch.setattr(pilot, "_native", None)  # native ticks call neither `read` nor `write`
    monkeypatch.setattr(twin, "write", wrote)
    monkeypatch.setattr(twin, "read", lambda: (state := read())._replace(current=other * state.current))
    with pytest.raises(RigError):
        pilot.run(worn.controller, motion.hold(pilot.q, 3.0, twin.period_s), "Floating")
    assert pilot.envelope.stop in (StopReason.TOO_FAST, StopReason.TORQUE_WRONG)
    assert pilot.envelope.powerless == {SHOULDER}
    assert max(hand) < 1.1 * hand[0]  # The first speed is from before any detection.
    assert max(hand[BRAKED_TICKS:]) < SINKING_M_S
