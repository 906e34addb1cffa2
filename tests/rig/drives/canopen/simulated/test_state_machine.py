"""A simulated drive goes through the states of CiA 402, by the table of the standard and by no other way."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.rig.drives.canopen.simulated.state_machine import StateMachine, StatusState
from exograv.rig.drives.canopen.states import ENABLE, next_control, state_of
from exograv.rig.drives.canopen.states import Cia402State as Read

STANDARD = """
2  SWITCH_ON_DISABLED   xxxx0xxxx110  READY_TO_SWITCH_ON
3  READY_TO_SWITCH_ON   xxxx0xxx0111  SWITCHED_ON
4  SWITCHED_ON          xxxx0xxx1111  OPERATION_ENABLED
5  OPERATION_ENABLED    xxxx0xxx0111  SWITCHED_ON
6  SWITCHED_ON          xxxx0xxxx110  READY_TO_SWITCH_ON
7  READY_TO_SWITCH_ON   xxxx0xxxxx0x  SWITCH_ON_DISABLED
7  READY_TO_SWITCH_ON   xxxx0xxxx01x  SWITCH_ON_DISABLED
8  OPERATION_ENABLED    xxxx0xxxx110  READY_TO_SWITCH_ON
9  OPERATION_ENABLED    xxxx0xxxxx0x  SWITCH_ON_DISABLED
10 SWITCHED_ON          xxxx0xxxxx0x  SWITCH_ON_DISABLED
10 SWITCHED_ON          xxxx0xxxx01x  SWITCH_ON_DISABLED
11 OPERATION_ENABLED    xxxx0xxxx01x  QUICK_STOP_ACTIVE
12 QUICK_STOP_ACTIVE    xxxx0xxxxx0x  SWITCH_ON_DISABLED
"""
"""Transitions of CiA 402-2 by control word: number, from, lowest bits of the word (x: any), to. Bit 7 is the fifth."""

STATUS = {
    "SWITCH_ON_DISABLED": ("x1xx0000", Read.SWITCH_ON_DISABLED),
    "READY_TO_SWITCH_ON": ("x01x0001", Read.READY),
    "SWITCHED_ON": ("x01x0011", Read.SWITCHED_ON),
    "OPERATION_ENABLED": ("x01x0111", Read.OPERATION_ENABLED),
    "QUICK_STOP_ACTIVE": ("x00x0111", Read.QUICK_STOP),
    "FAULT_REACTION_ACTIVE": ("x0xx1111", Read.FAULT_REACTION),
    "FAULT": ("x0xx1000", Read.FAULT),
    "NOT_READY_TO_SWITCH_ON": ("x0xx0000", Read.NOT_READY),
}
"""Patterns of the status word's low byte."""

WORDS = st.integers(0, 0xFFFF)


def fits(pattern: str, word: int) -> bool:
    """True if the lowest bits of a word match a pattern; control words are written without bits 4 to 6."""
    if len(pattern) == 12:
        pattern = pattern[4] + "xxx" + pattern[8:]
    bits = f"{word & 0xFF:08b}"
    return all(want in ("x", bit) for want, bit in zip(pattern, bits, strict=True))


ROWS = [line.split() for line in STANDARD.strip().splitlines()]


@given(state=st.sampled_from(list(StatusState)), word=WORDS)
def test_every_control_word_leads_where_the_standard_says_and_nowhere_else(state: StatusState, word: int):
    machine = StateMachine()
    machine.state = state
    machine.control(word)
    to = {target for _, source, pattern, target in ROWS if source == state.name and fits(pattern, word)}
    # A word that both switches on and enables goes one step at a time; the standard leaves this to the drive.
    if state is StatusState.READY_TO_SWITCH_ON and fits("xxxx0xxx1111", word):
        to = {"SWITCHED_ON"}
    assert machine.state.name in (to or {state.name})
    assert len(to) <= 1


@given(words=st.lists(WORDS, max_size=12))
def test_out_of_a_fault_leads_a_reset_that_the_drive_grants_and_nothing_else(words: list[int]):
    machine = StateMachine()
    machine.fail()
    before = 0
    for word in words:
        asks = machine.control(word)
        assert asks == bool(word & 0x80 and not before & 0x80)
        assert machine.state is StatusState.FAULT
        before = word
    machine.reset()
    assert machine.state is StatusState.SWITCH_ON_DISABLED


@pytest.mark.parametrize("name", STATUS)
def test_a_status_word_is_read_as_the_standard_says_whatever_its_other_bits_are(name: str):
    pattern, expected = STATUS[name]
    words = [word for word in range(0x10000) if fits(pattern, word)]
    assert words
    assert all(state_of(word) is expected for word in words)


@pytest.mark.parametrize("state", StatusState)
def test_what_a_simulated_drive_says_of_itself_is_what_the_standard_has_for_its_state(state: StatusState):
    assert fits(STATUS[state.name][0], state.value)


@given(words=st.lists(WORDS, max_size=20), fails=st.booleans())
def test_from_wherever_a_drive_is_six_steps_enable_it(words: list[int], fails: bool):
    machine = StateMachine()
    for word in words:
        machine.control(word)
    if fails:
        machine.fail()
    told = words[-1] if words else 0
    for _ in range(6):
        told = next_control(state_of(machine.state.value), told)
        if machine.control(told):
            machine.reset()
    assert machine.state is StatusState.OPERATION_ENABLED
    assert told == ENABLE


@given(words=st.lists(WORDS, max_size=30))
def test_no_drive_is_enabled_but_by_the_control_word_that_enables(words: list[int]):
    machine = StateMachine()
    for word in words:
        before = machine.state
        machine.control(word)
        if machine.state is StatusState.OPERATION_ENABLED and before is not StatusState.OPERATION_ENABLED:
            assert word & 0x8F == 0x0F
