"""Everything that a steered session says to whoever asks it, by the name under which a page has it in its languages."""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from exograv import sentence
from exograv.identification.core.interface import Outcome
from exograv.runtime.control_loop import steering
from exograv.safety.modes import Mode
from exograv.safety.stops import StopReason

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        **{said.sentence.code: said.value for said in (*Mode, *StopReason, *Outcome)},
        **steering.SENTENCES,
        "guard.absent": "There is no guard. Wait until the machine is off.",
        "guard.ended": "The guard's process has ended.",
        "guard.silent": "The guard did not answer in time. Look at what is shown before you ask again.",
        "desk.nobody": "Nobody steers: the operator's page was silent for {seconds} s. Open it again.",
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


say = partial(sentence.say, SENTENCES)
