"""The machine made for one side, with its person and their files; calibrated when somebody is first put in."""

from functools import cached_property, partial

import numpy as np

from exograv.laboratory.attentive_wearer import attentive_twin
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.arm_worker import LearnedArm
from exograv.loop.machine_limits import limits, refuse_motorless
from exograv.options import Side
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin.twin import PERIOD

from .options import SteeredOptions
from .participants import ParticipantFiles


class PreparedMachine:
    """One side's; of a machine for both arms there is one."""

    def __init__(self, options: SteeredOptions, side: Side | None):
        """Drawn, and not calibrated yet; the machine's first side where none is named.

        Raises:
            ConfigError: The rig or an option cannot be used.
        """
        self._options = options
        self.laboratory = draw_laboratory(options.rig, side, options.level, options.seed, donning=options.donning)
        self.description = self.laboratory.description
        refuse_motorless(self.description)
        connect, serial = partial(attentive_twin, self.laboratory), self.laboratory.serial
        assembly, form = self.laboratory.assembly(), self.laboratory.form
        self.people = ParticipantFiles(assembly, form, connect, PERIOD, serial, options.participants)
        self.participants = tuple(self.people.files())
        """Codes of those who may be put in."""
        self.torque_max_Nm = tuple(limits(self.description).torque_max_Nm.tolist())
        """Of the drives [N·m]."""

    @property
    def side(self) -> Side:
        """Whose arm is in it."""
        return self.description.side

    @cached_property
    def prepared(self) -> ControllerKnowledge:
        """The machine as calibrated, once; a minute passes where there is no file of it.

        Raises:
            ExogravError: The file is of another machine or side, or the calibration was refused.
        """
        options = self._options
        return Preparation(self.laboratory, options.seed).calibrated(options.calibration)

    def keep(
        self, prepared: ControllerKnowledge, code: str | None, learned: LearnedArm, predicted: np.ndarray
    ) -> str | None:
        """As `ParticipantFiles.keep`."""
        kept = self.people.keep(prepared, code, learned, predicted)
        self.participants = tuple(self.people.files())
        return kept
