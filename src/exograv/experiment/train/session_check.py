"""Check between two windows: has the arm changed in the machine since its identification?"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from exograv.errors import ConfigError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.drift.slow_change import FoundChange, SlowJudgement
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.model.arm import is_plausible
from exograv.procedures.identification.identify import V_MOTION
from exograv.procedures.identification.session_watch import LearnedAgain, SessionWatch, repeat_motion
from exograv.procedures.identification.watch_text import watch_text
from exograv.recording.rounding import rounded
from exograv.storage.session_checkpoint import KnownPerson

from .preparation import CheckedBetween, Ready, SlowChangeFigures, lay_down

FIRST = SlowJudgement((), (), 1.0)
"""Judgement of a motion that is the first one, after an interruption."""


def check_between(ready: Ready, after_windows: int, learns_again: bool) -> CheckedBetween:
    """Take the arm from its support, repeat the motion of its identification, judge it, and lay the arm down again.

    Args:
        ready: Machine that carries an arm, at gravity level 1. Its controller may be replaced.
        after_windows: Complete windows so far.
        learns_again: True to identify the arm again if the check finds a change.

    Raises:
        ConfigError: The machine only records.
        RigError: The envelope stopped the run.
    """
    pilot, controller, person = ready.pilot, ready.controller, ready.person
    if not isinstance(controller, ArmController) or person is None or not person.covariance:
        raise ConfigError(
            "--check-every needs a machine that carries an arm with a stated uncertainty; this one does not. Omit the "
            "option."
        )
    ready.put_room(False)
    if pilot.worn is None:
        pilot.worn = PersonLimitsManager(pilot.envelope, controller.assembly, controller.machine, controller.x)
    pilot.worn.expect(np.array(person.x), np.array(person.covariance), V_MOTION)
    samples = repeat_motion(pilot, controller)
    judgement, learned = FIRST, None
    if ready.watch is None:
        model = ArmModel(controller.assembly, controller.machine)
        ready.watch = SessionWatch(model, np.array(person.x), np.array(person.covariance), samples)
    else:
        judgement = ready.watch.judge(samples)
        if learns_again and not judgement.is_silent:
            learned = ready.watch.learn_again(samples, judgement)
    lay_down(pilot, controller, ready.put_room)
    is_taken = learned is not None and is_plausible(learned.assembly.arm, learned.carried.x)
    if learned is not None and is_taken:
        _carry(ready, controller, learned)
    else:
        pilot.worn.know(np.array(person.x))
    text = watch_text(judgement, is_taken)
    pilot.progress(text, 1.0)
    if pilot.recording is not None:
        pilot.recording.write("/event", pilot.rig.t, {"kind": "session check", "text": str(text)})
    return CheckedBetween(
        after_windows,
        _figures(judgement.changes),
        _figures(judgement.one_of),
        not judgement.is_restless,
        is_taken,
        str(text),
    )


def _carry(ready: Ready, before: ArmController, learned: LearnedAgain) -> None:
    """Carry the arm as identified again. The arm lies on its support, and the guard limits the torque's rate."""
    machine, carried = before.machine, learned.carried
    covariance = np.zeros((0, 0)) if carried.covariance is None else carried.covariance
    ready.controller = learned.controller(before, ready.pilot.rig.period_s)
    ready.person = KnownPerson.of(machine, carried.x, covariance, learned.assembly.slid_m)
    ready.model, ready.learner = ArmModel(learned.assembly, machine), None
    ready.pilot.worn = PersonLimitsManager(ready.pilot.envelope, learned.assembly, machine, carried.x)
    ready.pilot.worn.know(carried.x)


def _figures(changes: Sequence[FoundChange]) -> list[SlowChangeFigures]:
    return [
        SlowChangeFigures(
            one.cause.kind.value, one.cause.place, *rounded(np.array((one.size, one.half_width, one.probability)))
        )
        for one in changes
    ]


def with_check(ready: Ready, checked: CheckedBetween) -> None:
    """Add a check to the figures of the session."""
    ready.figures = replace(ready.figures, checked=[*(ready.figures.checked or []), checked])
