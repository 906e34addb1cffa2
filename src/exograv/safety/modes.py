"""Modes of use of the machine, and the table of the events that change them."""

import enum
import math
from dataclasses import dataclass

from exograv.sentence import Sentence, member_sentence

RAMP_IN_S = 5.0
"""Time in which the carried share of the arm's weight rises, along a cosine [s].

The weight of a heavy arm, 11 N·m, then comes at 3.4 N·m/s at most.
"""

RAMP_OUT_S = 3.0
"""Time in which the carried share of the arm's weight falls, as in a soft descent [s]."""

DRIFT_MAX_RAD = math.radians(5.0)
"""Largest permitted motion of a joint while the carried share of the arm's weight rises [rad]."""

SPEED_MAX_RAD_S = 0.5
"""Largest permitted joint speed while the carried share of the arm's weight rises [rad/s]."""


class Mode(enum.Enum):
    """Mode of use; the value is a sentence for the operator."""

    OFF = "The motors are off."
    SELF_TEST = "The machine tests itself; nobody is in it."
    EXO_ONLY = "The machine carries itself."
    RAMP_IN = "The machine takes over the arm's weight."
    FLOATING = "The arm floats."
    MOVING = "The arm is moved along a path."
    WEIGHING = "A weight is being weighed and carried."
    RAMP_OUT = "The machine gives the arm's weight back."
    SAFE = "The arm was let down softly. Reset, then begin with the self-test."

    @property
    def sentence(self) -> Sentence:
        """Value of the mode, with the code of its translations."""
        return member_sentence("mode", self)


class Event(enum.Enum):
    """Event that may change a mode; the value names who causes it."""

    TEST = "operator: test yourself"
    PASSED = "self-test: passed"
    FAILED = "self-test: failed"
    TAKE_ARM = "operator: take the arm"
    ARRIVED = "clock: the ramp is over"
    MOVE = "operator: move the arm"
    WEIGH = "operator: weigh"
    FLOAT = "operator: let it float"
    GIVE_BACK = "operator: give the arm back"
    SWITCH_OFF = "operator: switch off"
    FAULT = "guard: a fault"
    RESET = "operator: reset"


WORN = frozenset({Mode.RAMP_IN, Mode.FLOATING, Mode.MOVING, Mode.WEIGHING, Mode.RAMP_OUT})
"""Modes in which the machine carries a person's arm."""

_FREE = (Mode.FLOATING, Mode.MOVING, Mode.WEIGHING)
_CHANGES = ((Event.FLOAT, Mode.FLOATING), (Event.MOVE, Mode.MOVING), (Event.WEIGH, Mode.WEIGHING))

TRANSITIONS: dict[tuple[Mode, Event], Mode] = {
    (Mode.OFF, Event.TEST): Mode.SELF_TEST,
    (Mode.SELF_TEST, Event.PASSED): Mode.EXO_ONLY,
    (Mode.SELF_TEST, Event.FAILED): Mode.OFF,
    (Mode.EXO_ONLY, Event.TAKE_ARM): Mode.RAMP_IN,
    (Mode.RAMP_IN, Event.ARRIVED): Mode.FLOATING,
    (Mode.RAMP_IN, Event.GIVE_BACK): Mode.RAMP_OUT,
    **{(mode, event): after for mode in _FREE for event, after in _CHANGES if after is not mode},
    **{(mode, Event.GIVE_BACK): Mode.RAMP_OUT for mode in _FREE},
    (Mode.RAMP_OUT, Event.ARRIVED): Mode.EXO_ONLY,
    (Mode.SELF_TEST, Event.SWITCH_OFF): Mode.OFF,
    (Mode.EXO_ONLY, Event.SWITCH_OFF): Mode.OFF,
    # A fault while the motors are off is found by the next self-test.
    **{(mode, Event.FAULT): Mode.SAFE for mode in Mode if mode not in (Mode.OFF, Mode.SAFE)},
    (Mode.SAFE, Event.RESET): Mode.OFF,
}
"""All possible changes of mode.

A worn machine is never switched off. A reset leads from `SAFE` to `OFF` only, and never starts anything.
"""


@dataclass
class ModeMachine:
    """Mode in force, and the share of the arm that is carried in it."""

    mode: Mode = Mode.OFF
    arm_share: float = 0.0
    """Share of the arm's weight that control may carry [-]."""
    _since_s: float = 0.0
    _share_at_start: float = 0.0

    def take(self, event: Event) -> bool:
        """Change the mode by an event and return True; an event that is not in the table changes nothing."""
        after = TRANSITIONS.get((self.mode, event))
        if after is None:
            return False
        self.mode, self._since_s, self._share_at_start = after, 0.0, self.arm_share
        if after not in WORN:
            self.arm_share = 0.0
        return True

    def step(self, dt: float, drift_rad: float, fastest_rad_s: float) -> None:
        """Advance the time by one step.

        Args:
            dt: Time step [s].
            drift_rad: Largest motion of a joint since the ramp began [rad].
            fastest_rad_s: Speed of the fastest joint [rad/s].
        """
        self._since_s += dt
        if self.mode is Mode.RAMP_IN:
            if not (drift_rad <= DRIFT_MAX_RAD and fastest_rad_s <= SPEED_MAX_RAD_S):
                self.take(Event.GIVE_BACK)
                return
            self.arm_share = 0.5 - 0.5 * math.cos(math.pi * min(self._since_s / RAMP_IN_S, 1.0))
            if self._since_s >= RAMP_IN_S:
                self.take(Event.ARRIVED)
        elif self.mode is Mode.RAMP_OUT:
            self.arm_share = self._share_at_start * (1.0 - min(self._since_s / RAMP_OUT_S, 1.0))
            if self._since_s >= RAMP_OUT_S:
                self.take(Event.ARRIVED)


REST_BEFORE_RAMP_S = 1.0
"""Time for which the machine carries only itself before it takes the arm [s].

The guard and the control process both use it.
"""
