"""Rest between two windows in which the machine moves the relaxed arm and learns it."""

from dataclasses import replace

import numpy as np

from exograv.errors import ConfigError, IdentificationError
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.procedures.identification.identify import V_MOTION
from exograv.procedures.identification.rest_learning import RestLearned, RestLearner, Verdict, move_in_rest
from exograv.procedures.identification.rest_text import begins_text, rest_text
from exograv.recording.rounding import rounded
from exograv.storage.session_checkpoint import KnownPerson

from .preparation import Ready, RestFigures, lay_down, signals_of


def learn_in_rest(ready: Ready, after_windows: int) -> RestFigures:
    """Take the arm from its support, move it, learn it, lay it down again, and carry the new arm if it is taken.

    Args:
        ready: Machine that carries an arm, at gravity level 1.
        after_windows: Complete windows so far.

    Raises:
        ConfigError: The machine only records.
        IdentificationError: The first motion contradicts the participant's file. The arm lies on its support.
        RigError: The envelope stopped the run.
    """
    pilot, controller, person, model = ready.pilot, ready.controller, ready.person, ready.model
    if not isinstance(controller, ArmController) or person is None or model is None or not person.covariance:
        raise ConfigError("--learn-in-rests needs a machine that carries an arm; this one does not. Omit the option.")
    x = np.array(person.x)
    belief = x, np.array(person.covariance)
    learner = ready.learner = ready.learner or RestLearner(model, x, belief, signals_of(ready.muscles))
    pilot.progress(begins_text(), 0.0)
    if pilot.recording is not None:
        pilot.recording.write("/event", pilot.rig.t, {"kind": "rest begins", "text": str(begins_text())})
    ready.put_room(False)
    if pilot.worn is None:
        pilot.worn = PersonLimitsManager(pilot.envelope, controller.assembly, controller.machine, learner.x)
    pilot.worn.expect(learner.x, learner.covariance, V_MOTION)
    samples = move_in_rest(pilot, controller, learner.path(pilot.rig.period_s), ready.muscles)
    before = learner.x, learner.covariance
    if ready.returning is not None and not learner.rests:
        try:
            ready.returning.check(model, samples)
        except IdentificationError:
            lay_down(pilot, controller, ready.put_room)
            raise
    learned = learner.learn(samples)
    lay_down(pilot, controller, ready.put_room)
    is_taken = learned.verdict is Verdict.TAKEN and controller.publish(learner.x, pilot.q)
    if learned.verdict is Verdict.TAKEN and not is_taken:
        learner.keep(*before)
        learned = replace(learned, verdict=Verdict.IMPLAUSIBLE, stated_Nm=learner.stated_Nm)
    if is_taken or learned.verdict is Verdict.CONFIRMED:
        ready.person = KnownPerson.of(controller.machine, learner.x, learner.covariance, person.slid_m)
    pilot.worn.know(learner.x if is_taken else x)
    text = rest_text(learned, controller.assembly.description)
    pilot.progress(text, 1.0)
    if pilot.recording is not None:
        pilot.recording.write("/event", pilot.rig.t, {"kind": "rest learning", "text": str(text)})
    return _figures(learned, after_windows, is_taken, str(text))


def _figures(learned: RestLearned, after_windows: int, is_taken: bool, why: str) -> RestFigures:
    return RestFigures(
        after_windows, round(learned.motion_s, 2), learned.verdict.value, is_taken, rounded(learned.stated_Nm),
        rounded(learned.carried.share), why,
    )  # fmt: skip


def with_rest(ready: Ready, figures: RestFigures) -> None:
    """Add a rest to the figures of the session."""
    ready.figures = replace(ready.figures, learned=[*(ready.figures.learned or []), figures])
