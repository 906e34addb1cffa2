"""Muscle effort of a movement: a virtual wearer practises until the path is kept, then the effort is measured.

effort of a joint = ∫ |tau_muscle| dt
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.motion import Trajectory
from exograv.rig.twin import Twin
from exograv.rig.twin.behaviour.acting_wearer import ActingWearer, usual_physiology
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.rig.twin.behaviour.practice import Practice, tensed

from .movements import WantedMovement

TRACKING_MAX_DEG = 1.0
"""Largest RMS error of the worst joint with which two performances count as the same movement [°]."""

PERFORMANCES_MAX = 3
SURE_DEG = 0.9 * TRACKING_MAX_DEG  # Margin: the error of the measurement may exceed that of practice.
GO_RAD_PER_S = 0.6
SETTLE_S = 2.0

PerFreedom = Float[np.ndarray, " arm"]
Table = Float[np.ndarray, "tick arm"]


@dataclass(frozen=True)
class Effort:
    """Effort of one performance, per freedom of the arm."""

    absolute: PerFreedom
    """∫ |tau| dt [N·m·s]."""

    squared: PerFreedom
    """∫ tau² dt [N²·m²·s]."""

    tracking_deg: PerFreedom
    """RMS of wanted minus true angle [°]."""

    repetitions: int
    """Repetitions in practice before the measurement [-]."""

    @property
    def keeps_path(self) -> bool:
        """True if the performance may be compared with others."""
        return float(self.tracking_deg.max()) <= TRACKING_MAX_DEG


Note = Callable[[float], None]
"""Callback that receives the finished share of the first performance [-], from time to time."""


@dataclass(frozen=True)
class WearerExperience:
    """Knowledge of the machine and of the own arm, for a wearer with experience of the machine."""

    own: ArmInverseDynamics
    worn_inertia: Float[np.ndarray, "arm arm"]
    """Inertia of the machine about the arm's freedoms [kg·m²]."""


class Performer:
    """Wearer in a twin who repeats one movement with any controller of the machine."""

    def __init__(self, pilot: Pilot, twin: Twin, used_to: WearerExperience, movement: WantedMovement, note: Note):
        """Prepare the wearer. The pilot moves the twin."""
        self._pilot, self._twin, self._used_to, self._movement, self._note = pilot, twin, used_to, movement, note
        path = movement.path
        self._person = ActingWearer(usual_physiology(path.q.shape[1]), twin.period_s)
        self._errors, self._torques = np.zeros_like(path.q), np.zeros_like(path.q)
        self._done = 0

    def go_to_start(self, controller: Controller) -> None:
        """Move the arm to the start of the movement, by muscle alone.

        Raises:
            RigError: The envelope stopped the run. The following methods may raise it too.
        """
        path, dt = self._movement.path, self._twin.period_s
        go = motion.go_to(self._twin.truth.q_arm, path.q[0], GO_RAD_PER_S, dt)
        self._person.want(go, np.zeros((1, path.q.shape[1])), self._twin.t)
        self.wait(controller, go.seconds + SETTLE_S)

    def wait(
        self, controller: Controller, seconds: float, listener: Callable[[TickSample], None] = lambda _moment: None
    ) -> None:
        """Hold the wanted posture for this time [s]."""

        def act(moment: TickSample) -> None:
            self._act()
            listener(moment)

        self._run(controller, seconds, act)

    def perform(self, controller: Controller, gravity_level: float) -> Effort:
        """Practise until the path is kept, then measure; if it is never kept, return the last of some performances.

        Args:
            controller: Controller of the machine, after its handover.
            gravity_level: Share of the arm's weight that the person expects to feel before any practice [-].
        """
        path, body = self._movement.path, self._person.physiology
        middle = 0.5 * (path.q.min(axis=0) + path.q.max(axis=0))
        inertia = self._used_to.own.inertia(middle) + self._used_to.worn_inertia
        practice = Practice(path, body, inertia, self._used_to.own.torques(path, gravity_level))
        self._person.trusts_anticipation = True
        effort = self._practised(controller, practice, self._movement.practice[0])
        for _ in range(PERFORMANCES_MAX - 1):
            if effort.keeps_path:
                break
            effort = self._practised(controller, practice, 1)
        return effort

    def _practised(self, controller: Controller, practice: Practice, least: int) -> Effort:
        """Practise at least `least` times and until the path is kept, or return to the best practice; then measure."""
        best, done = (np.inf, practice.anticipated, self._person.tension), 0
        while done < least or (best[0] > SURE_DEG and self._done < self._movement.practice[1]):
            tried = practice.anticipated, self._person.tension
            self._repeat(controller, practice)
            practice.repeated(self._errors)
            self._person.tension = tensed(self._person.tension, self._errors, np.deg2rad(SURE_DEG))
            done, worst = done + 1, float(np.rad2deg(np.sqrt((self._errors**2).mean(axis=0))).max())
            if worst < best[0] or worst <= SURE_DEG:
                best = worst, *tried
        practice.anticipated, self._person.tension = best[1:]
        return self._measure(controller, practice)

    def _measure(self, controller: Controller, practice: Practice) -> Effort:
        n, repeats, dt = self._errors.shape[1], self._movement.repeats, self._twin.period_s
        absolute, squared, error = np.zeros(n), np.zeros(n), np.zeros(n)
        before = self._done
        for _ in range(repeats):
            self._repeat(controller, practice)
            absolute += np.abs(self._torques).sum(axis=0) * dt
            squared += (self._torques**2).sum(axis=0) * dt
            error += (self._errors**2).mean(axis=0) / repeats
        return Effort(absolute, squared, np.rad2deg(np.sqrt(error)), before)

    def _repeat(self, controller: Controller, practice: Practice) -> None:
        """Move once along the path, and store errors and torques."""
        path, tick = self._movement.path, 0
        self._person.want(path, practice.anticipated, self._twin.t)

        def act(_moment: TickSample) -> None:
            nonlocal tick
            self._act()
            self._errors[tick], self._torques[tick] = self._person.error, self._twin.tau_voluntary
            tick += 1

        self._run(controller, path.seconds, act)
        self._done += 1
        self._note(min(1.0, self._done / (self._movement.practice[0] + self._movement.repeats)))

    def _act(self) -> None:
        truth = self._twin.truth
        self._twin.tau_voluntary[:] = self._person.step(self._twin.t, truth.q_arm, truth.v_arm)

    def _run(self, controller: Controller, seconds: float, listener: Callable[[TickSample], None]) -> None:
        # The pilot needs a reference, but no feedback drives the machine to it here.
        still: Trajectory = motion.hold(self._pilot.q.copy(), seconds, self._twin.period_s)
        self._pilot.run(controller, still, "", listener)
