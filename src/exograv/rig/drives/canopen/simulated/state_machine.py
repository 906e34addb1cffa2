"""State machine of CiA 402 inside a simulated drive: control words in, status words out.

Written from the standard's tables, independently of the host's side (`rig.drives.canopen.states`).
"""

import enum


class StatusState(enum.Enum):
    """State of a drive; the value is its status word."""

    SWITCH_ON_DISABLED = 0x0240
    READY_TO_SWITCH_ON = 0x0231
    SWITCHED_ON = 0x0233
    OPERATION_ENABLED = 0x0237
    QUICK_STOP_ACTIVE = 0x0217
    FAULT_REACTION_ACTIVE = 0x021F
    FAULT = 0x0218


S = StatusState
TRANSITIONS = {
    "shutdown": {
        S.SWITCH_ON_DISABLED: S.READY_TO_SWITCH_ON,
        S.SWITCHED_ON: S.READY_TO_SWITCH_ON,
        S.OPERATION_ENABLED: S.READY_TO_SWITCH_ON,
    },
    "switch on": {S.READY_TO_SWITCH_ON: S.SWITCHED_ON, S.OPERATION_ENABLED: S.SWITCHED_ON},
    "enable operation": {S.SWITCHED_ON: S.OPERATION_ENABLED, S.READY_TO_SWITCH_ON: S.SWITCHED_ON},
    "disable voltage": dict.fromkeys(
        (S.READY_TO_SWITCH_ON, S.SWITCHED_ON, S.OPERATION_ENABLED, S.QUICK_STOP_ACTIVE), S.SWITCH_ON_DISABLED
    ),
    "quick stop": {
        S.READY_TO_SWITCH_ON: S.SWITCH_ON_DISABLED,
        S.SWITCHED_ON: S.SWITCH_ON_DISABLED,
        S.OPERATION_ENABLED: S.QUICK_STOP_ACTIVE,
    },
}
"""New state by command and state: transitions 2 to 12 of CiA 402. `StateMachine` makes transitions 1 and 13 to 15."""

COMMANDS = (
    (0x82, 0x00, "disable voltage"),
    (0x86, 0x02, "quick stop"),
    (0x87, 0x06, "shutdown"),
    (0x8F, 0x07, "switch on"),
    (0x8F, 0x0F, "enable operation"),
)
"""Mask of a control word, its masked value, and the command. With bit 7 it is a reset, or no command."""

RESET = 0x80


class StateMachine:
    """State machine of one drive under power, which has already left `not ready to switch on`."""

    def __init__(self):
        self.state = StatusState.SWITCH_ON_DISABLED
        self._last = 0

    def control(self, word: int) -> bool:
        """Take a control word; return True if it asks to reset a fault. Only the drive itself can grant that."""
        rises, self._last = word & RESET and not self._last & RESET, word
        if self.state is StatusState.FAULT:
            return bool(rises)
        for mask, value, name in COMMANDS:
            if word & mask == value:
                self.state = TRANSITIONS[name].get(self.state, self.state)
        return False

    def fail(self) -> None:
        """Enter the fault state.

        The reaction ends at once, because a simulated drive brakes by itself when it is off.
        """
        self.state = StatusState.FAULT

    def reset(self) -> None:
        """Leave the fault state, after the cause is gone and a host has asked."""
        self.state = StatusState.SWITCH_ON_DISABLED

    def end_quick_stop(self) -> None:
        """End a quick stop at standstill: the drive switches off, as in quick-stop option 2."""
        if self.state is StatusState.QUICK_STOP_ACTIVE:
            self.state = StatusState.SWITCH_ON_DISABLED
