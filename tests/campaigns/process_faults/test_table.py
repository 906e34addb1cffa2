"""The cells cover each pair of process and fault once, name themselves, and refuse what does not exist."""

import pytest
import tyro

from exograv.campaigns.process_faults.cell import Cell, Process, State
from exograv.campaigns.process_faults.hooks import TICKS, tick_of
from exograv.campaigns.process_faults.options import ProcessFaultOptions
from exograv.campaigns.process_faults.table import EXPECTED, all_cells, covering_cells, reason_absent
from exograv.errors import ConfigError


def test_the_covering_cells_have_each_pair_once_and_all_states():
    cells = covering_cells()
    assert sorted((cell.process, cell.fault) for cell in cells) == sorted(EXPECTED)
    assert {cell.state for cell in cells} == set(State)
    assert len(set(all_cells())) == len(State) * len(EXPECTED)


def test_a_cell_is_read_from_its_name():
    assert [Cell.of(cell.name) for cell in all_cells()] == all_cells()


@pytest.mark.parametrize("name", ["control", "contrl:kill:floating", "control:kill:flying", "control:kill:floating:x"])
def test_a_cell_that_does_not_exist_is_refused_with_those_that_do(name: str):
    with pytest.raises(ConfigError, match="--only is"):
        ProcessFaultOptions(only=(name,))


@pytest.mark.parametrize(
    "name", ["console:kill:floating", "lsl:kill:floating", "ros2:stop:moving", "control:disk:moving"]
)
def test_a_cell_that_cannot_be_flown_says_why(name: str):
    assert reason_absent(Cell.of(name))
    assert not reason_absent(Cell.of("control:kill:floating"))


@pytest.mark.parametrize("place", [place for places in TICKS.values() for place in places])
def test_each_tick_that_a_hook_replaces_exists(place: str):
    owner, name = tick_of(place)
    assert callable(getattr(owner, name))


def test_a_tick_that_the_product_has_renamed_is_an_error():
    with pytest.raises(ConfigError, match="does not exist"):
        tick_of("exograv.live.live_control:LiveControl.reply")


def test_every_process_of_a_session_has_a_tick():
    assert set(TICKS) == {process for process, _ in EXPECTED} - {Process.SESSION}


def test_only_can_be_repeated_on_the_command_line():
    words = ["--only", "control:kill:floating", "--only", "guard:kill:moving"]
    assert [cell.name for cell in tyro.cli(ProcessFaultOptions, args=words).planned] == words[1::2]
