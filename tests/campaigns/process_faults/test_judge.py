"""The judge of process faults accepts a soft descent in time, and names each thing that is wrong with a flight."""

from dataclasses import replace

import numpy as np
import pytest
from tests.campaigns.process_faults.made_up_process_flights import MACHINE, STRUCK_S, Course, evidence_of

from exograv.campaigns.process_faults.bare_loops import HostPause
from exograv.campaigns.process_faults.cell import Cell
from exograv.campaigns.process_faults.evidence import FlightEvidence
from exograv.campaigns.process_faults.judge import CellVerdict, judge
from exograv.campaigns.process_faults.table import EXPECTED
from exograv.safety.stops import StopReason

SOFT = Course(descends_s=0.004)


def judged(name: str, evidence: FlightEvidence) -> CellVerdict:
    cell = Cell.of(name)
    return judge(cell, EXPECTED[cell.process, cell.fault], evidence, MACHINE)


def test_a_soft_descent_in_time_is_as_expected():
    verdict = judged("control:kill:floating", evidence_of(SOFT))
    assert (verdict.status, verdict.seen, verdict.faults) == ("as expected", "lowered", ())
    assert verdict.reaction_ms == pytest.approx(4.5, abs=1.0)


def test_a_descent_after_its_budget_is_not_as_expected():
    verdict = judged("control:kill:floating", evidence_of(Course(descends_s=0.025)))
    assert verdict.status == "late"
    assert "budget 10" in verdict.faults[0]
    assert (verdict.is_bad(), verdict.is_bad(on_shared=True)) == (True, False)


@pytest.mark.parametrize(
    ("reason", "status"), [(StopReason.CONTROL_SILENT, "late"), (StopReason.TOO_FAST, "not as expected")]
)
def test_only_a_descent_that_a_pause_explains_counts_as_late(reason: StopReason, status: str):
    evidence = evidence_of(SOFT)
    assert evidence.ticks is not None
    stopped = replace(evidence, ticks=replace(evidence.ticks, stop=reason.value))
    verdict = judged("recorder:kill:floating", stopped)
    assert verdict.status == status
    assert verdict.is_bad(on_shared=True) == (status == "not as expected")


def test_brakes_in_place_of_a_descent_are_bad_on_a_shared_computer_too():
    assert judged("control:kill:floating", evidence_of(Course(silent_s=0.0))).is_bad(on_shared=True)


def test_a_pause_of_the_simulated_drives_is_added_to_the_budget():
    late = evidence_of(Course(descends_s=0.025))
    paused = late.drives._replace(pause_t=np.array([STRUCK_S + 0.02]), pause_s=np.array([0.018]))
    assert judged("control:kill:floating", evidence_of(Course(descends_s=0.025), drives=paused)).faults == ()


def test_drives_that_brake_instead_of_a_descent_are_not_as_expected():
    verdict = judged("control:kill:floating", evidence_of(Course(silent_s=0.0)))
    assert (verdict.status, verdict.seen) == ("not as expected", "braked")


def test_drives_that_brake_in_the_middle_of_a_descent_are_seen_as_braking():
    assert judged("parent:exception:floating", evidence_of(Course(0.05, silent_s=2.0))).seen == "braked"


def test_a_dead_guard_is_as_expected_only_if_the_drives_brake():
    assert judged("guard:kill:floating", evidence_of(Course(silent_s=0.0), exit_code=1)).status == "as expected"
    assert judged("guard:kill:floating", evidence_of(Course(), exit_code=1)).seen == "goes on"
    assert judged("guard:kill:floating", evidence_of(Course(), exit_code=1)).status == "not as expected"


def test_a_few_late_commands_are_no_braking():
    evidence = evidence_of(Course())
    braking = evidence.drives.is_braking.copy()
    braking[1200:1230] = 1.0  # 30 ms
    evidence = evidence_of(Course(), drives=evidence.drives._replace(is_braking=braking))
    assert judged("recorder:kill:floating", evidence).status == "as expected"


def test_a_descent_by_a_later_stop_is_no_reaction_to_the_strike():
    evidence = evidence_of(Course(descends_s=2.6), released_t=STRUCK_S + 2.5)
    assert judged("recorder:kill:floating", evidence).seen == "goes on"
    assert judged("control:kill:floating", evidence).status == "not as expected"


def test_a_torque_that_grows_in_a_descent_is_found():
    verdict = judged("control:kill:floating", evidence_of(Course(0.004, extra_Nm=2.0)))
    assert any("grows in the descent" in fault for fault in verdict.faults)


def test_a_step_beyond_the_rate_limit_is_found():
    verdict = judged("recorder:kill:floating", evidence_of(Course(steps_Nm=0.5)))
    assert any("a step of" in fault for fault in verdict.faults)


def test_commands_without_torque_that_enable_the_drives_are_no_step():
    evidence = evidence_of(SOFT)
    current = evidence.drives.command_current.copy()
    current[:3] = 0.0
    enabled = evidence.drives._replace(command_current=current)
    assert judged("control:kill:floating", evidence_of(SOFT, drives=enabled)).faults == ()


def test_a_torque_above_the_drives_is_found():
    evidence = evidence_of(SOFT)
    strong = evidence.drives._replace(command_current=evidence.drives.command_current + 12.0)
    assert any("above" in fault for fault in judged("control:kill:floating", evidence_of(SOFT, drives=strong)).faults)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ticks": None, "recording_why": "empty"}, "cannot be read: empty"),
        ({"acknowledged": 10_000_000}, "were acknowledged"),
        ({"left_memory": ("psm_1",)}, "/dev/shm: psm_1"),
        ({"left_processes": ("guard",)}, "did not end: guard"),
        ({"exit_code": None}, "did not end, also not after Stop"),
        ({"exit_code": 1}, "exit code 1"),
    ],
)
def test_each_thing_that_is_left_or_lost_is_named(change: dict, words: str):
    # Without a recording the reaction is not visible either, so only the words count.
    verdict = judged("recorder:kill:floating", evidence_of(Course(), **change))
    assert any(words in fault for fault in verdict.faults), verdict.faults
    assert verdict.status == "not as expected"


def test_in_a_descent_the_descent_must_go_on_to_its_end():
    pressed = STRUCK_S - 0.4
    assert judged("recorder:kill:descending", evidence_of(Course(-0.4), pressed_t=pressed)).status == "as expected"
    braked = evidence_of(Course(-0.4, silent_s=0.0), pressed_t=pressed)
    assert judged("recorder:kill:descending", braked).seen == "braked"


def test_a_session_that_ended_before_the_strike_is_never_passed():
    evidence = evidence_of(SOFT, stopped_before="the guard stopped the machine", struck_t=None)
    verdict = judged("control:kill:floating", evidence)
    assert (verdict.status, verdict.is_bad()) == ("not flown", True)
    assert judged("control:spin:floating", evidence_of(SOFT, struck_t=None)).status == "not flown"


def test_a_stop_by_late_simulated_drives_proves_nothing_unless_the_guard_itself_was_late():
    evidence = evidence_of(Course(descends_s=1.5))
    assert evidence.ticks is not None
    ticks = replace(evidence.ticks, stop=StopReason.MACHINE_SILENT.value)
    assert judged("recorder:kill:floating", replace(evidence, ticks=ticks)).status == "not flown"
    late = np.abs(ticks.t - STRUCK_S - 1.45) > 4e-3
    slow = replace(ticks, t=ticks.t[late], safe_state=ticks.safe_state[late], sequence=ticks.sequence[late])
    assert judged("recorder:kill:floating", replace(evidence, ticks=slow, acknowledged=0)).status == "late"
    other = replace(ticks, stop=StopReason.CONTROL_SILENT.value)
    assert judged("recorder:kill:floating", replace(evidence, ticks=other)).status == "late"


def test_a_process_that_should_be_replaced_and_is_not_fails():
    verdict = judged("lsl:kill:floating", evidence_of(Course(), replaced_t=None))
    assert verdict.faults == ("the process was not replaced",)
    assert judged("lsl:kill:floating", evidence_of(Course())).status == "as expected"


def test_pages_that_do_not_come_back_at_their_address_fail():
    verdict = judged("console:kill:floating", evidence_of(Course(), has_silent_pages=True))
    assert verdict.faults == ("the pages did not answer at their address any more",)


@pytest.mark.parametrize(("times", "status"), [(0, "not as expected"), (1, "as expected"), (2, "not as expected")])
def test_the_loss_of_the_bridge_has_to_be_told_exactly_once(times: int, status: str):
    output = times * "The bridge to ROS 2 has ended (exit status -9), and the run went on without it.\n"
    assert judged("ros2:kill:floating", evidence_of(Course(), output=output)).status == status


def test_a_strike_after_the_descent_proves_nothing():
    evidence = evidence_of(Course(descends_s=-2.9), pressed_t=STRUCK_S - 2.9)
    assert judged("recorder:spin:descending", evidence).faults == ("not flown: the descent was over before the strike",)
    evidence = evidence_of(Course(descends_s=-0.5), pressed_t=STRUCK_S - 0.5)
    assert judged("recorder:spin:descending", evidence).status == "as expected"


def late_beside(pauses: tuple[HostPause, ...] | None) -> CellVerdict:
    return judged("control:kill:floating", evidence_of(Course(descends_s=0.025), host_pauses=pauses))


def test_a_late_reaction_beside_bare_loops_in_time_is_not_as_expected():
    verdict = late_beside((HostPause(STRUCK_S + 0.02, 0.002, 0),))
    assert verdict.is_bad(on_shared=True)
    assert "bare loops paused for 2 ms" in verdict.faults[0]


@pytest.mark.parametrize("pauses", [None, (HostPause(STRUCK_S + 0.02, 0.018, 0),)])
def test_a_late_reaction_in_a_pause_of_the_computer_is_late(pauses: tuple[HostPause, ...] | None):
    verdict = late_beside(pauses)
    assert (verdict.status, verdict.settled().status) == ("late", "late")
    assert verdict.is_to_repeat == (pauses is not None)


def test_pauses_of_two_processors_do_not_add_up():
    each = tuple(HostPause(STRUCK_S + 0.02, 0.009, cpu) for cpu in (0, 1))
    assert late_beside(each).status == "not as expected"


@pytest.mark.parametrize(("pause_s", "status"), [(0.004, "late"), (0.001, "not as expected")])
def test_an_unneeded_descent_without_a_pause_is_not_as_expected_after_the_last_flight(pause_s: float, status: str):
    evidence = evidence_of(SOFT, host_pauses=(HostPause(STRUCK_S, pause_s, 0),))
    assert evidence.ticks is not None
    stopped = replace(evidence, ticks=replace(evidence.ticks, stop=StopReason.CONTROL_SILENT.value))
    verdict = judged("recorder:kill:floating", stopped)
    assert verdict.is_to_repeat
    assert verdict.settled().status == status
