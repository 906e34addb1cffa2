"""Replacement of recorded inputs in a replay: another person, another calibration or another gravity level."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, Parameters
from exograv.errors import ConfigError
from exograv.model.assembly import Assembly
from exograv.storage.calibration_file import read_calibration
from exograv.storage.participant_file import read_participant
from exograv.storage.participant_schema import parameter_names

from .options import InsteadOptions


@dataclass(frozen=True)
class ReplayOverrides(InsteadOptions):
    """Replacements of recorded inputs; the recorded value is used where absent."""

    @property
    def is_anything(self) -> bool:
        """True if anything is replaced, so that the replay is another run than the recorded one."""
        return self != ReplayOverrides()

    @property
    def arm_is_other(self) -> bool:
        """True if the guard's table of the person has to be made anew too."""
        return any(one is not None for one in (self.rig, self.person, self.calibration))

    def machine(self, recorded: CalibratedMachine, assembly: Assembly) -> CalibratedMachine:
        """Calibrated machine: the replacement, or the recorded one.

        Raises:
            ConfigError: The file cannot be used, or belongs to another machine.
        """
        if self.calibration is None:
            return recorded
        stored = self._calibration
        joints = tuple(row.joint for row in stored.joints)
        if joints != assembly.description.joints:
            raise ConfigError(
                f"{self.calibration} is of a machine with the joints {', '.join(joints)}; the recording's machine has "
                f"{', '.join(assembly.description.joints)}. Give a calibration of that machine with --calibration."
            )
        return stored.calibration().machine

    def parameters(self, x: Parameters, machine: CalibratedMachine, assembly: Assembly) -> Parameters:
        """Parameters in place of `x`: of the other person, with friction and rotor inertia of the other calibration.

        Raises:
            ConfigError: The file cannot be used, or belongs to another kind of arm.
            ValueError: The number of parameters is not that of this arm.
        """
        layout = ParameterLayout.of(assembly)
        if x.shape != (layout.count,):
            raise ValueError(f"The recording holds {x.size} parameters; this arm has {layout.count}.")
        if self.person is not None:
            x = self._person(assembly)
        if self.calibration is None:
            return x
        x = x.copy()
        x[layout.rotor] = machine.rotor_inertia
        x[layout.coulomb] = np.asarray(machine.friction.coulomb)
        x[layout.viscous] = np.asarray(machine.friction.viscous)
        return x

    def _person(self, assembly: Assembly) -> Parameters:
        whole = self._participant
        names = parameter_names(assembly)
        if [row.name for row in whole.parameters] != names:
            raise ConfigError(
                f"{self.person} has other parameters than the {len(names)} of this arm: it is of another "
                "machine or side. Give a participant file from the recorded machine with --person."
            )
        return whole.mean

    @cached_property
    def _calibration(self) -> Any:
        return read_calibration(self.calibration) if self.calibration is not None else None

    @cached_property
    def _participant(self) -> Any:
        return read_participant(self.person) if self.person is not None else None


AS_RECORDED = ReplayOverrides()
