"""Calibration of the twin's empty machine for `exograv rig calibrate`, and the true values for comparison."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.calibration.empty_prior import EmptyPrior
from exograv.loop.pilot import Progress
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Excitation
from exograv.options import TwinName, WorldName
from exograv.procedures.calibration.calibrate_command import TruthAt
from exograv.procedures.calibration.figures import CalibrationTruth
from exograv.procedures.calibration.options import CalibrateOptions
from exograv.recording import RecordingWriter
from exograv.rig.twin import Disturbances, Machine, draw_machine
from exograv.storage.calibration_file import twin_identity

from .result_rows import still_to_rub
from .twin_calibration import EmptyTwin, pilots
from .virtual_laboratory import machine_of


@dataclass(frozen=True)
class EmptyTwinMachine:
    """`EmptyMachine` of these options: the twin without a wearer."""

    options: CalibrateOptions
    description: RigDescription
    progress: Progress

    @property
    def serial(self) -> str:
        """Identity of the twin of this level and seed."""
        return twin_identity(self.options.level, self.options.seed, self.options.world)

    @property
    def truth(self) -> TruthAt:
        """True values of the twin's machine."""
        return truth_of_machine(self.description, self.options.level, self.options.seed, self.options.world)

    def calibrate(
        self, lengths: Mapping[str, float], motion: Excitation | None, known: EmptyPrior | None
    ) -> tuple[Calibration, float]:
        """Calibrate from cold; return the result and the rig's clock at the end [s]."""
        path, empty = self.options.recording, self._empty(lengths)
        if path is None:
            return empty.calibrate(pilots(self.description, self.progress), motion, known)
        settings = {
            "rig": self.description.name,
            "side": self.description.side,
            "command": "rig calibrate",
            "disturbance_level": self.options.level,
            "seed": self.options.seed,
        }
        with RecordingWriter(path, self.description.joints, settings, packed=True) as recording:
            return empty.calibrate(pilots(self.description, self.progress, recording), motion, known)

    def recheck(self, before: Calibration, lengths: Mapping[str, float]) -> tuple[Calibration, float]:
        """Measure friction again, all else as `before`; return the result and the rig's clock at the end [s]."""
        return self._empty(lengths).recheck(before, pilots(self.description, self.progress))

    def _empty(self, lengths: Mapping[str, float]) -> EmptyTwin:
        disturbances = Disturbances.at_level(self.options.level, self.options.world)
        machine = draw_machine(self.description, disturbances, self.options.seed)
        return EmptyTwin(self.description, machine, self.options.seed, lengths)


def truth_of_machine(
    description: RigDescription, level: int, seed: int, world: WorldName = "home", twin: TwinName = "drawn"
) -> TruthAt:
    """Return a function of the clock [s] for the true values of the machine of this level, seed, world and twin.

    Raises:
        ConfigError: The machine has no fitted twin, and `twin` asks for it.
    """
    return partial(calibration_truth, machine_of(description, Disturbances.at_level(level, world), seed, twin))


def calibration_truth(machine: Machine, t: float) -> CalibrationTruth:
    """Return the true values of a machine that has run for `t` seconds from cold."""
    friction, still, gravity = machine.friction, still_to_rub(machine, t), machine.gravity
    return CalibrationTruth(
        machine.drives.gain,
        machine.sensors.encoder_offset,
        np.arcsin(gravity[:2] / np.linalg.norm(gravity)),
        {
            "coulomb": still * friction.coulomb,
            "viscous": still * friction.viscous,
            "breakaway": friction.breakaway,
            "load_share": friction.load_share,
            "asymmetry": still * friction.coulomb * friction.asymmetry,
            "v_stribeck": friction.stribeck_velocity,
        },
    )
