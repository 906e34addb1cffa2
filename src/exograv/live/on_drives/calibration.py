"""Calibration of an empty machine on its bus (`exograv rig calibrate --drives`), after a passed bring-up."""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from exograv.control.exo_tick import most_damping
from exograv.dynamics.actuator import ActuatorGain
from exograv.identification.calibration.empty_machine import GAIN_SD, Calibration
from exograv.identification.calibration.empty_prior import EmptyPrior
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot, Progress
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Excitation
from exograv.model.tree import Tree
from exograv.procedures.calibration.calibrate import calibrate_machine, recheck_machine
from exograv.procedures.calibration.calibrate_command import TruthAt
from exograv.procedures.calibration.options import CalibrateOptions
from exograv.recording import RecordingWriter

from .connection import CONNECTING, Connected, Say, connected, drawn_by, not_ready


@contextlib.contextmanager
def empty_drives(
    options: CalibrateOptions,
    folder: Path,
    description: RigDescription,
    truth: TruthAt | None,
    progress: Progress,
    say: Say,
) -> Iterator["EmptyDrives"]:
    """Connect to the drives of an empty machine. A real machine must have passed its bring-up in `folder`.

    Raises:
        ConfigError: The file of the drives or the sheet of the bring-up cannot be used.
        RigError: A drive does not answer, or is not the drive in the file.
    """
    progress(CONNECTING, 0.0)
    refuse = not_ready(options, folder, description, "rig calibrate", say)
    with connected(options, description, say, "A calibration", refuse) as machine:
        yield EmptyDrives(options, description, machine, truth, progress)


@dataclass(frozen=True)
class EmptyDrives:
    """Empty machine on its bus; an `EmptyMachine`."""

    options: CalibrateOptions
    description: RigDescription
    machine: Connected
    truth: TruthAt | None
    progress: Progress

    @property
    def serial(self) -> str:
        """Serial number of the drives."""
        return self.machine.serial

    def calibrate(
        self, lengths: Mapping[str, float], motion: Excitation | None, known: EmptyPrior | None
    ) -> tuple[Calibration, float]:
        """Calibrate, with a further motion if one is given; return also how long the machine ran [s].

        Raises:
            As `calibrate_machine`.
        """
        nominal, tree = self.description.nominal_gain, self._tree(lengths)
        weights = self.machine.hands.weights
        with self._recording() as recording:
            if recording is not None:
                recording.phase(self.machine.rig.t, "calibrate")
            pilot = self._pilot(ActuatorGain(nominal, GAIN_SD * nominal), tree, recording)
            return calibrate_machine(self.description, tree, pilot, weights, motion, known), self.machine.rig.t

    def _recording(self) -> contextlib.AbstractContextManager[RecordingWriter | None]:
        path = self.options.recording
        if path is None:
            return contextlib.nullcontext()
        settings = {
            "rig": self.description.name,
            "side": self.description.side,
            "command": "rig calibrate",
            **drawn_by(self.options),
        }
        return RecordingWriter(path, self.description.joints, settings, packed=True)

    def recheck(self, before: Calibration, lengths: Mapping[str, float]) -> tuple[Calibration, float]:
        """Measure friction anew and keep the rest of `before`; return also how long the machine ran [s].

        Raises:
            As `recheck_machine`.
        """
        tree = self._tree(lengths)
        pilot = self._pilot(before.machine.actuators, tree)
        return recheck_machine(self.description, tree, pilot, before), self.machine.rig.t

    def _tree(self, lengths: Mapping[str, float]) -> Tree:
        return adjusted(read_exoskeleton(self.description), self.description, lengths)

    def _pilot(self, gains: ActuatorGain, tree: Tree, recording: RecordingWriter | None = None) -> Pilot:
        worn = limits(self.description)
        # Without an arm a light machine oscillates under the damping that suits a worn machine.
        damping = np.minimum(worn.damping_Nms_per_rad, most_damping(self.description, tree))
        return self.machine.pilot(gains, replace(worn, damping_Nms_per_rad=damping), self.progress, recording)
