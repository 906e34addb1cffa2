"""Gravity levels up to 1.8: what the arm feels in the machine, and the same person in a room with that gravity."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.control.tick import ControlMode
from exograv.errors import RigError
from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin.examiner import rms
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.task.flight_profile import FlightProfile

from .effort import Effort, Note, Performer, WearerExperience
from .movements import WantedMovement
from .preparation import Preparation, WornTwin
from .transparency_trial import UNREST, TransparencyTrial, effort_alone
from .truth_score import Examination

RENEW_S = 60.0
"""Time after which the person in a long phase above Earth gravity agrees again [s]."""

SETTLES_S = 2.0
"""Time after a ramp until the person holds the arm still again [s]."""

SAMPLE_TICKS = 10
"""Ticks between two samples of a parabola."""


class FeltLevel:
    """Level that the guard makes and control follows; listener of the ticks of a person who agrees to a push."""

    def __init__(self, pilot: Pilot, controller: ArmController):
        """Follow the guard's level from now on."""
        self._pilot, self._controller, self._agreed_at = pilot, controller, -np.inf
        self.lowest = self.level
        """Lowest level since the last request [-]."""

    @property
    def level(self) -> float:
        """Level in force [-]."""
        person = self._pilot.envelope.person
        return 0.0 if person is None else person.gravity_level

    def ask(self, level: float) -> float:
        """Ask the guard for a level, and return the time that its ramp takes [s].

        Raises:
            RigError: The guard refused.
        """
        if level > 1.0:
            self._agree()
        if not self._pilot.guard.feel(level):
            raise RigError(f"The guard refused gravity level {level:g}. The recording shows the reason.")
        return abs(level - self.level) * GRAVITY_LEVEL_S

    def __call__(self, moment: TickSample) -> None:
        """Let control follow, and agree again before the consent runs out."""
        level = self.level
        self._controller.mode.gravity_level = level
        self.lowest = min(self.lowest, level)
        if level > 1.0 and moment.state.t - self._agreed_at > RENEW_S:
            self._agree()

    def _agree(self) -> None:
        if not self._pilot.guard.consent():
            raise RigError("The guard did not take the consent: nobody is in the machine, or it has stopped.")
        self._agreed_at = self._pilot.rig.t


@dataclass(frozen=True)
class LevelComparison:
    """Person at one gravity level, in the machine and in a room."""

    lowest: float
    """Lowest level that the guard let the person feel during the movement [-]."""
    machine: Effort
    room: Effort


def felt_errors(
    trial: TransparencyTrial, known: ControllerKnowledge, levels: Sequence[float]
) -> dict[float, Float[np.ndarray, " joint"]]:
    """Error of the arm's weight that is felt, RMS over held-out postures [N·m], by level.

    The machine's own error counts whole. The arm's counts by the share of its weight that the machine carries or adds.
    """
    examination = Examination(trial.laboratory(), known.assembly, known.machine)
    arm = examination.arm_error(known.x)
    alone = examination.at_postures(known.x, ControlMode()) - arm
    return {level: rms(alone + (1.0 - level) * arm) for level in levels}


def compare(
    trial: TransparencyTrial,
    known: ControllerKnowledge,
    level: float,
    movement: WantedMovement,
    note: Note = lambda _share: None,
) -> LevelComparison:
    """Measure the same movement in the machine at this level, and without a machine in a room of this gravity.

    The guard has the person's limits, as in a session.

    Raises:
        ExogravError: The guard refused the level, or stopped the run.
    """
    worn, performer = _seated(trial, known, movement, note)
    performer.go_to_start(worn.controller)
    performer.wait(worn.controller, performer.felt.ask(level) + SETTLES_S)
    performer.felt.lowest = performer.felt.level
    in_machine = performer.perform(worn.controller, level)
    room = effort_alone(trial, movement, known.t, level, note)
    return LevelComparison(performer.felt.lowest, in_machine, room)


class FollowingPerformer(Performer):
    """Performer whose machine follows the guard's gravity level in each tick."""

    def __init__(self, felt: FeltLevel, *of_performer: Any):
        """Follow this level; the further values are those of a `Performer`."""
        super().__init__(*of_performer)
        self.felt = felt

    def _run(self, controller: Controller, seconds: float, listener: Callable[[TickSample], None]) -> None:
        def both(moment: TickSample) -> None:
            listener(moment)
            self.felt(moment)

        super()._run(controller, seconds, both)


@dataclass(frozen=True)
class ParabolaFlown:
    """Parabola on the ground: a person who holds the hand still while the level goes 1, 1.8, 0, 1.8, 1."""

    t: Float[np.ndarray, " sample"]
    """Time since the beginning [s]."""
    level: Float[np.ndarray, " sample"]
    off_deg: float
    """Largest distance of any freedom from the held posture [°]."""
    rate_Nm_per_s: float
    """Largest change of the commanded torque of any joint within 10 ms [N·m/s]."""


def fly_parabola(
    trial: TransparencyTrial, known: ControllerKnowledge, movement: WantedMovement, profile: FlightProfile
) -> ParabolaFlown:
    """Fly one parabola of a flight's profile on the ground; the guard's ramps take longer, and begin earlier.

    Raises:
        ExogravError: The guard refused a level, or stopped the run.
    """
    worn, performer = _seated(trial, known, movement, lambda _share: None)
    felt, twin = performer.felt, worn.twin
    performer.go_to_start(worn.controller)
    performer.wait(worn.controller, felt.ask(1.0) + SETTLES_S)
    begin, ticks, rows = twin.t, itertools.count(), list[tuple[np.ndarray, ...]]()

    def note(moment: TickSample) -> None:
        if next(ticks) % SAMPLE_TICKS == 0:
            now = np.array([twin.t - begin, felt.level])
            rows.append((now, twin.truth.q_arm.copy(), moment.tau_commanded.copy()))

    def wait_until(at_s: float) -> None:
        performer.wait(worn.controller, max(at_s - (twin.t - begin), 0.0), note)

    for level, starts_s in level_starts(profile):
        wait_until(starts_s)
        performer.wait(worn.controller, felt.ask(level), note)
    wait_until(twin.t - begin + SETTLES_S)
    now, arm, tau = (np.array(column) for column in zip(*rows, strict=True))
    rate = np.abs(np.diff(tau, axis=0)).max() / (SAMPLE_TICKS * twin.period_s)
    off = float(np.rad2deg(np.abs(arm - arm[0]).max()))
    return ParabolaFlown(now[:, 0], now[:, 1], off, float(rate))


def level_starts(profile: FlightProfile) -> list[tuple[float, float]]:
    """Return the levels of a parabola's phases, and when the guard's ramp to each begins after the start [s].

    The guard's ramps take longer than the aircraft's. Those before the window begin earlier and those after it end
    later, so that the window keeps its length.
    """
    corners = profile.corners
    phases = [(level, start, end) for (start, level), (end, after) in pairwise(corners) if level == after]
    window = min(phases)[1]
    return [
        (level, start - GRAVITY_LEVEL_S * abs(level - before) if start <= window else end)
        for (before, _, end), (level, start, _) in pairwise(phases)
    ]


def _seated(
    trial: TransparencyTrial, known: ControllerKnowledge, movement: WantedMovement, note: Note
) -> tuple[WornTwin, "FollowingPerformer"]:
    """Put the person into the machine, with the guard's limits for this arm."""
    laboratory = trial.laboratory(*UNREST)
    worn = Preparation(laboratory, trial.seed).worn(known)
    worn.limit_to_person()
    used_to = WearerExperience(laboratory.own_arm(), laboratory.worn_inertia())
    felt = FeltLevel(worn.pilot, worn.controller)
    return worn, FollowingPerformer(felt, worn.pilot, worn.twin, used_to, movement, note)
