"""Machine of one side with its person and files. It is calibrated when the first person is prepared."""

import time
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Any

from exograv.laboratory.attentive_wearer import attentive_twin
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.live_processes import LiveResult
from exograv.loop.machine_limits import limits, refuse_motorless
from exograv.next_command import calibration_command
from exograv.options import Side
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig import Rig
from exograv.rig.twin.twin import PERIOD
from exograv.storage.calibration_file import read_calibration

from .options import SteeredOptions
from .participants import ParticipantFiles
from .work_progress import CalibrationProgress


class PreparedMachine:
    """The twin as a `SteeredMachine`."""

    is_twin, starts_on_request = True, False

    def __init__(self, options: SteeredOptions, side: Side | None):
        """Draw the machine without calibrating it. Without `side` the machine has its first side.

        Raises:
            ConfigError: The rig or an option is not valid, or the calibration cannot be read.
        """
        self._options, self._make = options, calibration_command(options)
        if options.calibration is not None:
            read_calibration(options.calibration, self._make)  # Refused now, and not on the page minutes later.
        self.laboratory = draw_laboratory(
            options.rig, side, options.level, options.seed, donning=options.donning, world=options.world
        )
        self.description = self.laboratory.description
        refuse_motorless(self.description)
        assembly, self.form = self.laboratory.assembly(), self.laboratory.form
        self.people = ParticipantFiles(assembly, self.form, PERIOD, self.laboratory.serial, options.participants)
        """Codes of the persons with a file."""
        self.torque_max_Nm = tuple(limits(self.description).torque_max_Nm.tolist())
        """Torque limits of the drives [N·m]."""
        self.calibrating: CalibrationProgress | None = None
        """Progress of the calibration; absent before it, after it, and with a stored calibration."""

    @property
    def side(self) -> Side:
        """Side of the arm in the machine."""
        return self.description.side

    @cached_property
    def _prepared(self) -> ControllerKnowledge:
        """Controller's knowledge of the machine, calibrated once. Without a calibration file this takes a minute.

        Raises:
            ExogravError: The file is of another machine or side, or the calibration was refused.
        """
        options = self._options
        if options.calibration is not None:
            return Preparation(self.laboratory, options.seed).calibrated(options.calibration, make=self._make)
        self.calibrating = CalibrationProgress(time.monotonic)
        try:
            return Preparation(self.laboratory, options.seed, self.calibrating).calibrated()
        finally:
            self.calibrating = None

    def prepare(self) -> ControllerKnowledge:
        """Return the controller's knowledge of the machine. The first call calibrates the machine without a file.

        Raises:
            ExogravError: The file is of another machine or side, or the calibration was refused.
        """
        return self._prepared

    def machine_key(self) -> None:
        """Return None: a twin is not locked."""

    def rig(self, prepared: ControllerKnowledge) -> Callable[[], Rig]:
        """Return the function that builds the twin."""
        return partial(attentive_twin, self.laboratory, self._options.seed, prepared.t)

    def recorded(self) -> Mapping[str, Any]:
        """Return the disturbances of the twin, the options, and the run."""
        options = self._options
        drawn = {"disturbance_level": options.level, "world": options.world, "seed": options.seed}
        return {**drawn, "settings": {"options": options.written(), **options.stated()}}

    def hear(self, _mode_name: str, /) -> None:
        """Do nothing: the guard's process tells the wearer of the twin."""

    def ended(self, _flown: LiveResult, /) -> str:
        """Return an empty text: the operator resets the stop of a twin."""
        return ""

    def close(self) -> None:
        """Do nothing: the twin ends with its process."""
