"""Scores of the controller on the twin's truth. They never enter the run."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.control.resting import Resting, RestingTorque
from exograv.control.tick import ControlMode
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.core.interface import Estimate
from exograv.model.assembly import Assembly
from exograv.model.wearer_form import WearerForm
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.recording.rounding import rounded
from exograv.rig.twin import Examiner
from exograv.rig.twin.examiner import rms

from .posterior_torque import PosteriorTorque, posterior_torque
from .virtual_laboratory import VirtualLaboratory

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class TruthScore:
    """Residual torque: RMS over the held-out postures, per joint [N·m]."""

    total: Joints
    arm: Joints


class Examination:
    """Residual torque of the controller at held-out postures, or at given ones, on the twin's truth."""

    def __init__(
        self,
        laboratory: VirtualLaboratory,
        assembly: Assembly,
        machine: CalibratedMachine,
        postures: Postures | None = None,
    ):
        self._laboratory = laboratory
        description, wearer = laboratory.description, laboratory.wearer
        self._examiner = Examiner(description, laboratory.machine, wearer, postures=postures)
        self._resting = RestingTorque(assembly, machine)
        self._assembly, self._actuators = assembly, machine.actuators
        self._last: tuple[Parameters, Float[np.ndarray, "posture freedom"]] | None = None

    @cached_property
    def _empty(self) -> Examiner:
        """Examiner of the same machine with the same lengths, without the wearer."""
        laboratory = self._laboratory
        return Examiner(
            laboratory.description,
            laboratory.machine,
            None,
            laboratory.wearer.lengths_given,
            self._examiner.postures,
        )

    @property
    def postures(self) -> Postures:
        """Postures of the examination [rad]."""
        return self._examiner.postures

    def slide_cuff(self, name: str, along_m: float) -> None:
        """Score with a cuff that has moved along the limb, as by `Twin.slide_cuff` [m]."""
        self._examiner.slide_cuff(name, along_m)

    def score(self, x: Parameters, payload_kg: float = 0.0) -> TruthScore:
        """Score these parameters in the level-0 controller, with a hidden weight in the hand."""
        asked: list[Resting] = []

        def all_currents(q: Postures) -> Postures:
            asked.append(self._at_rest(q, x, ControlMode()))
            return self._actuators.current(asked[0].tau_desired)

        total = self._examiner.left_over(all_currents, payload_kg)
        # The second call has the same postures, so the torque is reused.
        arm = self._examiner.arm_left_over(lambda _q: self._actuators.current(asked[0].tau_arm), payload_kg)
        return TruthScore(rms(total), rms(arm))

    def arm_error(self, x: Parameters) -> Postures:
        """Residual torque of the arm alone: torque at rest of its weight and strained cuffs, minus the compensation.

        The machine's own error is not included, because no estimate of the arm can correct it.
        """
        total, empty = self.at_postures(x, ControlMode()), ControlMode(arm_share=0.0)
        alone = self._empty.left_over(lambda q: self._actuators.current(self._at_rest(q, x, empty).tau_desired))
        return total - alone

    def exo_only(self, x: Parameters) -> Joints:
        """Residual torque when only the exoskeleton is carried, RMS per joint [N·m]."""
        return self.left_over(x, ControlMode(arm_share=0.0))

    def left_over(self, x: Parameters, mode: ControlMode) -> Joints:
        """Residual torque in this mode, RMS per joint [N·m]."""
        return rms(self.at_postures(x, mode))

    def at_postures(self, x: Parameters, mode: ControlMode) -> Postures:
        """Residual torque in this mode, posture by posture [N·m]."""
        return self._examiner.left_over(lambda q: self._actuators.current(self._at_rest(q, x, mode).tau_desired))

    def posterior_torque(self, estimate: Estimate) -> PosteriorTorque | None:
        """Residual torque that the estimate's own uncertainty allows. It does not use the truth."""
        return posterior_torque(self._resting, self._assembly, estimate)

    def _at_rest(self, q: Postures, x: Parameters, mode: ControlMode) -> Resting:
        arms = np.tile(x, (len(q), 1))
        if self._last is not None:
            before, z = self._last
            resting = self._resting(q, arms, z, mode, np.tile(before, (len(q), 1)))
            if resting.is_closed.all():
                self._last = x.copy(), resting.z
                return resting
        # First call, or parameters so far from the last ones that Newton's method lost a posture.
        resting = self._resting(q, arms, self._resting.cold_start(q, x), mode)
        self._last = x.copy(), resting.z
        return resting


@dataclass(frozen=True)
class ScoredWearer:
    """Wearer of a virtual laboratory in a live run: the form, and a score at the end."""

    laboratory: VirtualLaboratory

    @property
    def form(self) -> WearerForm:
        """Body data and lengths, as an operator measures them."""
        return self.laboratory.form

    def left_over_Nm(self, known: ControllerKnowledge, x: Parameters, postures: Postures | None = None) -> list[float]:
        """Residual torque with parameters `x`, RMS per joint [N·m]; over held-out postures if none are given."""
        examination = Examination(self.laboratory, known.assembly, known.machine, postures)
        return rounded(examination.score(x).total)
