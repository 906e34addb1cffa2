"""The cells cover each pair of process and fault once, name themselves, and refuse what does not exist."""

import pytest
import tyro

from exograv.campaigns.process_faults.cell import Cell, Fault, Loop, Process, State
from exograv.campaigns.process_faults.hooks import SENDERS, TICKS, acting, tick_of
from exograv.campaigns.process_faults.options import ProcessFaultOptions
from exograv.campaigns.process_faults.sessions import HARMLESS, leaves_alive, sessions_of
from exograv.campaigns.process_faults.strikes import IN_HOOK
from exograv.campaigns.process_faults.table import (
    EXPECTED,
    GOES_ON,
    OF_LOOP,
    all_cells,
    covering_cells,
    expected_of,
    python_cells,
    reason_absent,
)
from exograv.errors import ConfigError


def test_every_process_with_every_fault_has_an_expected_outcome_or_a_reason_why_not():
    for process in Process:
        for fault in Fault:
            assert bool(reason_absent(process, fault)) != ((process, fault) in EXPECTED)


def test_a_fault_that_every_process_can_have_is_flown_at_every_process():
    for fault in (Fault.KILL, Fault.STOP, Fault.SPIN, Fault.TERMINATE, Fault.EXCEPTION, Fault.MEMORY):
        assert {process for process, one in EXPECTED if one is fault} == set(Process) - {Process.SESSION}


def test_all_cells_fly_each_expected_pair_in_each_state_and_in_both_loops():
    cells = all_cells()
    assert len(set(cells)) == len(cells)
    for loop, processes in ((Loop.C, set(Process)), (Loop.PYTHON, set(OF_LOOP))):
        flown = {(one.process, one.fault, one.state) for one in cells if one.loop is loop}
        assert flown == {(*pair, state) for pair in EXPECTED if pair[0] in processes for state in State}


def test_the_covering_cells_have_each_pair_once_and_all_states():
    cells = covering_cells()
    assert {cell.loop for cell in cells} == {Loop.C}
    assert sorted((cell.process, cell.fault) for cell in cells) == sorted(EXPECTED)
    for process in (Process.CONSOLE, Process.LSL, Process.ROS2):
        assert {cell.state for cell in cells if cell.process is process} == set(State)


def test_the_cells_in_python_have_each_pair_of_the_loop_once_and_all_states():
    cells = python_cells()
    pairs = [(cell.process, cell.fault) for cell in cells]
    assert sorted(pairs) == sorted(pair for pair in EXPECTED if pair[0] in OF_LOOP)
    for process in OF_LOOP:
        assert {cell.state for cell in cells if cell.process is process} == set(State)


def test_neighbours_of_the_guard_never_stop_it():
    for (process, _), expected in EXPECTED.items():
        if process in (Process.WORKER, Process.RECORDER, Process.CONSOLE, Process.LSL, Process.ROS2):
            assert expected.outcomes == GOES_ON


def test_sessions_hold_each_cell_once_and_only_cells_that_leave_the_session_alive():
    for cells in (covering_cells(), all_cells()):
        sessions = sessions_of(cells)
        assert sorted(cell.name for one in sessions for cell in one) == sorted(cell.name for cell in cells)
        assert len(sessions) < 0.75 * len(cells)
        for one in sessions:
            assert len(one) == 1 or all(leaves_alive(cell) for cell in one)
            assert len({(cell.state, cell.loop) for cell in one}) == 1


def test_a_cell_that_changes_the_exit_code_shares_no_session():
    for session in sessions_of(all_cells()):
        assert len(session) == 1 or {expected_of(cell).exits for cell in session} == {(0,)}


def test_a_session_strikes_a_process_again_only_after_it_is_replaced():
    for session in sessions_of(all_cells()):
        for process in Process:
            *before, _ = [cell for cell in session if cell.process is process] or [None]
            assert all(one is None or one.fault in HARMLESS or expected_of(one).is_replaced for one in before)


def test_a_cell_is_read_from_its_name():
    assert [Cell.of(cell.name) for cell in all_cells()] == all_cells()


MISTAKEN = (
    "control", "contrl:kill:floating", "control:kill:flying", "control:kill:floating:x", "control:kill:floating:c:x"
)  # fmt: skip


@pytest.mark.parametrize("name", MISTAKEN)
def test_a_cell_that_does_not_exist_is_refused_with_those_that_do(name: str):
    with pytest.raises(ConfigError, match="--only is"):
        ProcessFaultOptions(only=(name,))


PLACES = {place for places in TICKS.values() for place in places} | {place for place, _ in SENDERS.values()}


@pytest.mark.parametrize("place", sorted(PLACES))
def test_each_tick_that_a_hook_replaces_exists(place: str):
    owner, name = tick_of(place)
    assert callable(getattr(owner, name))


def test_a_tick_that_the_product_has_renamed_is_an_error():
    with pytest.raises(ConfigError, match="does not exist"):
        tick_of("exograv.live.live_control:LiveControl.reply")


def test_every_process_of_a_session_has_a_tick():
    assert set(TICKS) == {process for process, _ in EXPECTED} - {Process.SESSION}


def test_every_fault_of_a_hook_is_made_by_a_process_that_has_a_hook():
    for cell in all_cells():
        if cell.fault in IN_HOOK:
            assert set(acting(cell)) <= set(TICKS)
            assert cell.fault is not Fault.HALF_MESSAGE or cell.process in SENDERS


def test_only_can_be_repeated_on_the_command_line():
    words = ["--only", "control:kill:floating", "--only", "guard:kill:moving"]
    assert [cell.name for cell in tyro.cli(ProcessFaultOptions, args=words).planned] == words[1::2]
