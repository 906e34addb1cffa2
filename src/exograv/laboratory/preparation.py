"""Steps from a drawn laboratory to an identified arm: calibrated machine, worn twin, identified arm.

Each step can be taken alone. The seeds of a run are those of its `Preparation`; no step draws anything of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.parameters import Parameters
from exograv.errors import RigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.core.interface import Estimate, Outcome
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.pilot import Pilot, Progress
from exograv.model.assembly import Assembly
from exograv.procedures.identification.controller_knowledge import MOTION_S, ControllerKnowledge
from exograv.procedures.identification.estimator_session import Belief, Identification, table_guess
from exograv.procedures.identification.identify import Identifier, identify_arm
from exograv.procedures.identification.method_names import MethodName, TorqueSourceName
from exograv.procedures.self_test.bench import TestedMachine
from exograv.recording import RecordingWriter
from exograv.rig.twin import Twin
from exograv.rig.twin.world.surroundings import Surroundings
from exograv.storage.calibration_file import MAKE, take_calibration

from .truth_score import Examination, Postures
from .twin_calibration import EmptyTwin, PilotOf, pilots
from .virtual_laboratory import VirtualLaboratory

EstimateListener = Callable[[float, Estimate, np.ndarray | None, Outcome], None]
"""Callback, called once a second: rig time [s], estimate, predicted residual torque [N·m], verdict of the stop rule."""


def no_progress(_text: str, _share: float) -> None:
    """Ignore progress messages. Default for callers that do not show progress."""


@dataclass(frozen=True)
class WornTwin:
    """Simulated machine with its wearer; its pilot uses the controller's knowledge of both."""

    laboratory: VirtualLaboratory
    known: ControllerKnowledge
    twin: Twin
    pilot: Pilot
    controller: ArmController

    def identifier(
        self,
        method: MethodName = "recursive",
        torque_source: TorqueSourceName = "current",
        listener: EstimateListener = lambda *_: None,
        belief: Belief | None = None,
    ) -> Identifier:
        """Make the estimator of this arm; it starts from the table where no `belief` is given."""
        return Identifier(self.pilot, self.controller, self.known.machine, method, torque_source, listener, belief)

    def identify(self, identifier: Identifier, seconds: float = MOTION_S) -> Identification:
        """Move the relaxed arm by the machine's own motion and identify it.

        Raises:
            RigError: The envelope stopped the run.
        """
        return identify_arm(self.pilot, self.controller, identifier, seconds)

    def limit_to_person(self, expected: Parameters | None = None) -> None:
        """Give the guard the limits of the arm as known; `expected` parameters count until then, the same if absent."""
        known, start = self.known, self.known.x if expected is None else expected
        self.pilot.worn = PersonLimitsManager(self.pilot.envelope, known.assembly, known.machine, start)
        self.pilot.worn.know(known.x)

    def examination(self, postures: Postures | None = None) -> Examination:
        """Make the examiner that scores estimates on the twin's truth."""
        return Examination(self.laboratory, self.known.assembly, self.known.machine, postures)


@dataclass(frozen=True)
class Preparation:
    """Steps of one run on the twin."""

    laboratory: VirtualLaboratory
    seed: int
    """Draws noise and muscles of the run."""
    progress: Progress = no_progress
    recording: RecordingWriter | None = None
    is_realtime: bool = False
    """True to keep the pace of the wall clock."""

    @property
    def pilot_of(self) -> PilotOf:
        """Function that makes the pilot of a twin whose motors have given gains."""
        return pilots(self.laboratory.description, self.progress, self.recording, self.is_realtime)

    def calibrated(
        self, file: Path | None = None, assembly: Assembly | None = None, make: str = MAKE
    ) -> ControllerKnowledge:
        """Return what control knows about the machine, from its stored calibration, or from a new one without a `file`.

        Args:
            file: Calibration of the machine.
            assembly: Machine and arm for the software; if None, with the wearer's own body data.
            make: Command that calibrates this machine, for the advice in a message.

        Raises:
            ConfigError: The file is damaged, foreign or stale.
            ExogravError: The machine or the run was refused.
        """
        if file is None:
            return self.known(*self.calibrate(), assembly)
        laboratory = self.laboratory
        taken = take_calibration(file, laboratory.description, laboratory.serial, datetime.now(UTC), make)
        return self.known(taken.whole.calibration(), 0.0, assembly)

    def calibrate(self) -> tuple[Calibration, float]:
        """Calibrate the empty machine from cold; return the result and the rig's clock at the end [s].

        Raises:
            ExogravError: The machine or the run was refused.
        """
        return self._empty.calibrate(self.pilot_of)

    def under_test(self, known: ControllerKnowledge) -> TestedMachine:
        """Return the empty machine for its self-test.

        Raises:
            RigError: The machine was not calibrated.
        """
        if known.calibration is None:
            raise RigError("The self-test needs a calibration, and this machine has none. Calibrate it first.")
        return self._empty.under_test(known.calibration)

    @property
    def _empty(self) -> EmptyTwin:
        laboratory = self.laboratory
        return EmptyTwin(laboratory.description, laboratory.machine, self.seed, laboratory.wearer.lengths_given)

    def known(self, calibration: Calibration, t: float, assembly: Assembly | None = None) -> ControllerKnowledge:
        """Knowledge of the machine from this calibration at rig time `t` [s], and of the arm from the table."""
        assembly, machine = assembly or self.laboratory.assembly(), calibration.machine
        return ControllerKnowledge(assembly, machine, table_guess(assembly, machine), t, calibration)

    def worn(self, known: ControllerKnowledge, surroundings: Surroundings | None = None) -> WornTwin:
        """Put the wearer into the machine, at the rig time of the calibration."""
        return worn_twin(self.laboratory, known, self.seed, self.pilot_of, surroundings)

    def identified(self, method: MethodName = "recursive") -> ControllerKnowledge:
        """Calibrate the machine now and identify the arm in it.

        Raises:
            ExogravError: The machine, the wearer or the run was refused.
        """
        known = self.calibrated()
        worn = self.worn(known)
        found = worn.identify(worn.identifier(method))
        return replace(known, x=found.floated.x, t=worn.twin.t, covariance=found.floated.covariance)


def prepare(
    laboratory: VirtualLaboratory, seed: int, progress: Progress, method: MethodName = "recursive"
) -> ControllerKnowledge:
    """Calibrate a machine and identify its wearer's arm by this method.

    Raises:
        ExogravError: The machine, the wearer or the run was refused.
    """
    return Preparation(laboratory, seed, progress).identified(method)


def unit_gains(joints: int) -> ActuatorGain:
    """Gains of a machine whose motors give no torque: one newton metre per ampere."""
    return ActuatorGain(np.ones(joints), np.zeros(joints))


def worn_twin(
    laboratory: VirtualLaboratory,
    known: ControllerKnowledge,
    seed: int,
    pilot_of: PilotOf,
    surroundings: Surroundings | None = None,
) -> WornTwin:
    """Put the wearer into the machine, flown by a pilot of this kind; `seed` draws noise and muscles."""
    twin = laboratory.twin(seed, known.t, surroundings=surroundings)
    pilot = pilot_of(twin, known.machine.actuators)
    controller = ArmController(known.assembly, known.machine, known.x, twin.period_s)
    return WornTwin(laboratory, known, twin, pilot, controller)
