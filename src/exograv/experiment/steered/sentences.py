"""Everything that a steered session says to whoever asks it, by the name under which a page has it in its languages."""

from collections.abc import Mapping
from types import MappingProxyType

from exograv.identification.core.interface import Outcome
from exograv.runtime.control_loop import guard_commands as hearing
from exograv.runtime.control_loop import steering
from exograv.safety.modes import Mode
from exograv.safety.stops import StopReason

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        **{f"mode.{mode.name.lower()}": mode.value for mode in Mode},
        **{f"stop.{reason.name.lower()}": reason.value for reason in StopReason},
        **{f"outcome.{outcome.name.lower()}": outcome.value for outcome in Outcome},
        "guard.nobody": steering.NOBODY,
        "guard.not_askable": steering.NOT_ASKABLE,
        "guard.stopped": steering.STOPPED,
        "guard.still_down": hearing.STILL_DOWN,
        "guard.absent": "There is no guard. Wait until the machine is off.",
        "guard.ended": "The guard's process has ended.",
        "guard.silent": "The guard did not answer in time. Look at what is shown before you ask again.",
        "desk.nobody": "Nobody steers: the operator's page was silent for {seconds} s. Open it again.",
        "desk.nobody_any_more": steering.NOBODY_ANY_MORE,
        "desk.not_possible": steering.NOT_POSSIBLE,
        "desk.no_step_one": steering.NO_STEP_ONE,
        "desk.not_begun": "The session has not begun yet. Wait until the machine is off.",
        "desk.not_stopped": "Nothing was stopped.",
        "desk.stopped": "{latch} Reset it first.",
        "desk.let_down": "{latch} " + Mode.SAFE.value,
        "desk.unknown_arm": "This arm is not known yet. Identify it first.",
        "desk.unchecked": "This arm is checked when it is taken. Its weight can be set after that.",
        "desk.known_arm": "This arm is known. To identify it again, switch off and put the person in anew.",
        "desk.same_id": "Another act had this identifier.",
        "desk.late": "It came {seconds} s after it was asked for; allowed: {allowed} s. Ask again.",
        "desk.changed": "Something has changed since this was shown. Look again.",
        "desk.no_side": "This machine has no {side} side. There are: {sides}.",
        "desk.no_file": "There is no file of {person} here. Files there: {people}.",
        "desk.no_alarm": "There is no alarm of number {number}.",
        "flight.calibrates": "The machine is calibrated.",
        "flight.starts": "Guard and control are starting.",
        "flight.recording_over": "The recording has come to its end. Put the person in anew to go on.",
        "flight.recording_ends": "The recording ends in less than five minutes; the arm is let down then.",
        "flight.control_again": "Control has died or did not answer, and was started anew.",
        "flight.other_person": "The file of {person} is not this person's, or much has changed.",
        "rehearsal.still_down": "The arm is still coming down.",
        "rehearsal.identified": "The arm is identified.",
    }
)
"""English, with gaps; a gap may hold another sentence."""


def say(code: str, **gaps: object) -> str:
    """One of them, filled."""
    return SENTENCES[code].format(**gaps)
