"""The guard's limits of the person hold when all checks before have accepted a wrong arm."""

import pytest

from exograv import motion
from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import RigError
from exograv.identification.core.prior import prior
from exograv.loop.mode_ramp import fade
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.procedures.identification.identify import V_MOTION
from exograv.safety.stops import StopReason

HAND_MAX_M_S = {False: 1.1, True: 0.2}
"""Largest speed of the hand, by knowledge of the arm. The goal is 1.0 (docs/explanation/safety.md)."""

STOPS = (StopReason.NOT_THIS_ARM, StopReason.TOO_FAST, StopReason.PAST_A_STOP, StopReason.MODEL_LOST)
"""Reasons of a stop that mean that another arm is in the machine."""

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("is_known", [False, True])
@pytest.mark.parametrize("rig", ["recupera_like", "recupera_like_qdd"])
def test_a_weight_typed_ten_times_too_high_stays_slow_and_comes_down(put_on, monkeypatch, is_known: bool, rig: str):
    worn = put_on(2, rig=rig)
    pilot, controller, twin = worn.pilot, worn.controller, worn.twin
    guarded = PersonLimitsManager(pilot.envelope, controller.assembly, worn.machine, worn.table)
    guarded.expect(*prior(controller.assembly, worn.machine), V_MOTION)
    fade(pilot, controller, "gravity_level", 0.0, pilot.q.copy())
    if is_known:
        guarded.know(worn.table)
        controller.mode.drive = 1.0
        fade(pilot, controller, "drive", 0.0, pilot.q.copy())
    tenfold = worn.table.copy()
    tenfold[ParameterLayout.of(controller.assembly).phi] *= 10.0
    controller.put_in_force(tenfold)
    hand, write = [], twin.write

    def watched(command):
        write(command)
        hand.append(twin.hand_speed())

    monkeypatch.setattr(twin, "write", watched)
    hold = motion.hold(pilot.q.copy(), 3.0, pilot.rig.period_s)
    with pytest.raises(RigError):  # native ticks call no `write`; the ticks of the descent have no listener
        pilot.run(controller, hold, "Floating", lambda _: hand.append(twin.hand_speed()))
    print(f"{rig}, {'floating' if is_known else 'in identification'}: {max(hand):.2f} m/s")
    assert pilot.envelope.stop in STOPS
    assert max(hand) < HAND_MAX_M_S[is_known]


def test_the_guard_hears_of_the_gravity_level_that_is_faded_to(put_on):
    worn = put_on(0)
    pilot, controller = worn.pilot, worn.controller
    PersonLimitsManager(pilot.envelope, controller.assembly, worn.machine, worn.table).know(worn.table)
    fade(pilot, controller, "gravity_level", 0.4, pilot.q.copy())
    assert pilot.envelope.person is not None
    assert pilot.envelope.person.gravity_level == controller.mode.gravity_level == 0.4
