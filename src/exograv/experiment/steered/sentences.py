"""Sentences of a steered session, by the codes under which the pages have their translations."""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from exograv import sentence
from exograv.identification.core.interface import Outcome
from exograv.procedures.calibration import phase_texts
from exograv.procedures.identification import rest_text, watch_text
from exograv.runtime.control_loop import steering
from exograv.safety.modes import Mode
from exograv.safety.stops import StopReason

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        **{said.sentence.code: said.value for said in (*Mode, *StopReason, *Outcome)},
        **steering.SENTENCES,
        **phase_texts.SENTENCES,
        **watch_text.SENTENCES,
        **rest_text.SENTENCES,
        "guard.absent": "There is no guard. Wait until the machine is off.",
        "guard.ended": "The guard's process has ended.",
        "guard.silent": "The guard did not answer in time. Check the display before you ask again.",
        "desk.nobody": "No operator steers: the operator's page was silent for {seconds} s. Open it again.",
        "desk.not_begun": "The session has not begun yet. Wait until the machine is off.",
        "desk.not_stopped": "Nothing was stopped.",
        "desk.stopped": "{latch} Reset it first.",
        "desk.let_down": "{latch} " + Mode.SAFE.value,
        "desk.unknown_arm": "This arm is not known yet. Identify it first.",
        "desk.unchecked": "This arm is checked when the machine takes it. Its support can be set after that.",
        "desk.known_arm": "This arm is known. To identify it again, switch off and put the person in again.",
        "desk.same_id": "Another request had this identifier.",
        "desk.late": "The request arrived {seconds} s after it was made; allowed: {allowed} s. Ask again.",
        "desk.changed": "The state has changed since it was shown. Check the display again.",
        "desk.no_side": "This machine has no {side} side. There are: {sides}.",
        "desk.no_file": "There is no file of {person} here. Available files: {people}.",
        "desk.no_alarm": "There is no alarm with number {number}.",
        "flight.calibrates": "The machine is being calibrated.",
        "flight.starts": "Guard and control are starting.",
        "flight.streams": "Looking for the streams {streams}.",
        "flight.stream_lost": "The stream {stream} is gone: its program has ended. It is recorded again on its return.",
        "flight.stream_silent": "The stream {stream} sends nothing. Check its device.",
        "flight.late_start": (
            "The motors did not switch on within {seconds} s after the request, so they stay off. Make the machine "
            "ready again."
        ),
        "flight.error": (
            "The session of this machine had an internal error and has ended: {error}. Put the person in again to "
            "continue."
        ),
        "flight.recording_over": "The recording has ended. Put the person in again to continue.",
        "flight.locked": "{cause} The machine is locked. Take the person out, and repeat the self-test: {command}.",
        "flight.recording_ends": "The recording ends in less than five minutes; then the arm is let down.",
        "flight.control_again": "The controller failed or did not answer, and was restarted.",
        "flight.other_person": "The file of {person} does not fit this arm: another person's file, or a large change.",
        "flight.refuted_file": (
            "The stored estimate of {person} disagreed with its check at unused postures, so it is not used. Identify "
            "the arm again."
        ),
        "flight.carried_in_part": "{why}",
        "flight.other_form": "{why} The arm was let down. Correct the form, then begin again.",
        "flight.rehearses": "The rehearsal shows a calibration. Nothing is measured.",
        "work.calibration": (
            "Every joint moves slowly and fast, without and with known weights: only so can friction, the machine's "
            "own weight and the motor's torque constant be told apart. A stored calibration (--calibration) saves this."
        ),
        "work.identification": (
            "The machine moves the arm for {seconds} s through many postures: a share of the weight shows only in some "
            "of them, and slow and fast motion tells weight from stiffness and friction. Relax the arm."
        ),
        "work.rest": (
            "The machine moves the relaxed arm through other postures than before, learns it, and carries the new arm "
            "if it is more certain. Relax the arm."
        ),
        "work.begins": "The machine begins to move the arm.",
        "work.moves": "The machine moves the arm and weighs it on the way.",
        "work.over": "The motion ends; the arm then floats.",
        "learning.relax": (
            "{left_over} N·m, the target is {target} N·m. Ask the person to relax and to hold nothing: only a relaxed "
            "arm that the machine moves shows its weight."
        ),
        "learning.again": (
            "{left_over} N·m, the target is {target} N·m. Pointing does not lower it. Check the cuffs, switch off, put "
            "the person in again, and repeat the identification while the person relaxes."
        ),
        "rest.help": "Between two windows the machine can move the relaxed arm for {seconds} s and learn it.",
        "rest.runs": "The machine learns the arm in this rest. Wait until the arm floats.",
        "rest.prepares": "Learning in the rests is being prepared. Ask again in some seconds.",
        "rest.process_ended": (
            "The machine cannot learn in rests: the process that learns has failed, or the identified arm is not "
            "plausible. The arm in force stays. Put the person in again."
        ),
        "rest.not_taken": "The machine did not take the arm's whole weight in time.",
        "rest.ended_early": "The motion in the rest ended early, and the arm in force stays: {why}",
        "rest.stored": "The arm is stored in the file of {person}.",
        "rest.stored_refuted": (
            "The file of {person} says that this estimate disagrees with its check. The next session identifies the "
            "arm again."
        ),
        "rest.kept_before": "The participant's file keeps the estimate from before, which is more certain.",
        "rest.not_stored": "What the rests have shown is not in the participant's file: {why}",
        "rest.unlearned": "Identify or check the arm first. The machine learns in rests from then on.",
        "learning.reached": "All joints are within their targets. No further motion is needed.",
        "rehearsal.not_agreed": "Not agreed yet: the arm may not be pushed down.",
        "rehearsal.rest": "The rehearsal shows a rest in which a machine learns the arm. Nothing is measured.",
        "rehearsal.still_down": "The arm is still coming down.",
        "rehearsal.identified": "The arm is identified.",
    }
)
"""Sentences in English, with fields. A field may hold another sentence."""


say = partial(sentence.say, SENTENCES)
