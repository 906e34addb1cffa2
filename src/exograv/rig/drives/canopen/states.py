"""The state machine of CiA 402, from the side of who commands: what a status word says, and which control word is next.

Source: CiA 402-2 (IEC 61800-7-201), state machine and tables of status and control word.
"""

import enum


class State(enum.Enum):
    """Of one drive; the value is a word for the operator."""

    NOT_READY = "not ready yet"
    SWITCH_ON_DISABLED = "switched off"
    READY = "ready to be switched on"
    SWITCHED_ON = "switched on, without torque"
    OPERATION_ENABLED = "enabled"
    QUICK_STOP = "in a quick stop"
    FAULT_REACTION = "reacting to a fault"
    FAULT = "in a fault"


SHUTDOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE, QUICK_STOP, RESET = 0x06, 0x07, 0x0F, 0x00, 0x02, 0x80
"""Control words."""

MASKED = (
    (0x4F, 0x00, State.NOT_READY),
    (0x4F, 0x40, State.SWITCH_ON_DISABLED),
    (0x6F, 0x21, State.READY),
    (0x6F, 0x23, State.SWITCHED_ON),
    (0x6F, 0x27, State.OPERATION_ENABLED),
    (0x6F, 0x07, State.QUICK_STOP),
    (0x4F, 0x0F, State.FAULT_REACTION),
    (0x4F, 0x08, State.FAULT),
)
"""Mask of a status word, what it leaves, and the state that this is."""


def _state_of(low_byte: int) -> State:
    for mask, value, state in MASKED:
        if low_byte & mask == value:
            return state
    return State.NOT_READY  # no state of the standard: nothing that could be trusted with torque


_BY_LOW_BYTE = tuple(_state_of(byte) for byte in range(256))


def state_of(status_word: int) -> State:
    """What a status word says; bits beside those of the state do not matter."""
    return _BY_LOW_BYTE[status_word & 0xFF]


NEXT = {
    State.NOT_READY: DISABLE_VOLTAGE,
    State.SWITCH_ON_DISABLED: SHUTDOWN,
    State.READY: SWITCH_ON,
    State.SWITCHED_ON: ENABLE,
    State.OPERATION_ENABLED: ENABLE,
    State.QUICK_STOP: DISABLE_VOLTAGE,
    State.FAULT_REACTION: DISABLE_VOLTAGE,
    State.FAULT: RESET,
}
"""Control word of one step towards `OPERATION_ENABLED`."""


def next_control(state: State, last: int) -> int:
    """The control word that leads on from here; a reset counts by its rising edge, so it is not told twice in a row."""
    word = NEXT[state]
    return DISABLE_VOLTAGE if word == RESET == last else word
