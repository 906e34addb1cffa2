"""State machine of CiA 402 from the host's side: state of a status word, and the next control word.

Source: CiA 402-2 (IEC 61800-7-201), state machine and tables of status and control word.
"""

import enum


class Cia402State(enum.Enum):
    """State of one drive; the value is a word for the operator."""

    NOT_READY = "not ready yet"
    SWITCH_ON_DISABLED = "switched off"
    READY = "ready to be switched on"
    SWITCHED_ON = "switched on, without torque"
    OPERATION_ENABLED = "enabled"
    QUICK_STOP = "in a quick stop"
    FAULT_REACTION = "reacting to a fault"
    FAULT = "in a fault"


SHUTDOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE, QUICK_STOP, RESET = 0x06, 0x07, 0x0F, 0x00, 0x02, 0x80
"""Control words that request a transition of the CiA 402 state machine."""

MASKED = (
    (0x4F, 0x00, Cia402State.NOT_READY),
    (0x4F, 0x40, Cia402State.SWITCH_ON_DISABLED),
    (0x6F, 0x21, Cia402State.READY),
    (0x6F, 0x23, Cia402State.SWITCHED_ON),
    (0x6F, 0x27, Cia402State.OPERATION_ENABLED),
    (0x6F, 0x07, Cia402State.QUICK_STOP),
    (0x4F, 0x0F, Cia402State.FAULT_REACTION),
    (0x4F, 0x08, Cia402State.FAULT),
)
"""Mask of a status word, its masked value, and the state."""


def _state_of(low_byte: int) -> Cia402State:
    for mask, value, state in MASKED:
        if low_byte & mask == value:
            return state
    return Cia402State.NOT_READY  # no state of the standard: such a drive must not get torque


_BY_LOW_BYTE = tuple(_state_of(byte) for byte in range(256))


def state_of(status_word: int) -> Cia402State:
    """Return the state in a status word; its other bits do not matter."""
    return _BY_LOW_BYTE[status_word & 0xFF]


NEXT = {
    Cia402State.NOT_READY: DISABLE_VOLTAGE,
    Cia402State.SWITCH_ON_DISABLED: SHUTDOWN,
    Cia402State.READY: SWITCH_ON,
    Cia402State.SWITCHED_ON: ENABLE,
    Cia402State.OPERATION_ENABLED: ENABLE,
    Cia402State.QUICK_STOP: DISABLE_VOLTAGE,
    Cia402State.FAULT_REACTION: DISABLE_VOLTAGE,
    Cia402State.FAULT: RESET,
}
"""Control word of one step towards `OPERATION_ENABLED`."""


def next_control(state: Cia402State, last: int) -> int:
    """Return the control word of the next step. A reset works by its rising edge, so it is not sent twice in a row."""
    word = NEXT[state]
    return DISABLE_VOLTAGE if word == RESET == last else word
