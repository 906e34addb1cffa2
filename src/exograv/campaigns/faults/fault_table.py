"""Table of all faults: injector, permitted stop reasons, detection budget, and the safe state that protects the person.

Identifiers and budgets: docs/explanation/safety.md, after the project's fault table.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

from . import control_faults as of_control
from . import machine_faults as of_machine
from . import person_faults as of_person
from .injector import Injector


@dataclass(frozen=True)
class Fault:
    """Row of the fault table: one fault, how it must be detected, and the safe state that must follow."""

    id: str
    """Identifier as in docs/explanation/safety.md."""

    injector: type[Injector]

    reasons: tuple[StopReason, ...] = ()
    """Stop reasons that the guard may report; empty if the fault has to be tolerated without a stop."""

    budget_ms: float | None = None
    """Time from the fault's beginning to the first command of the safe state [ms]; None where the fault shows only
    in motion, or where no detection is required."""

    safe_state: SafeState = SafeState.NONE
    """Weakest safe state that protects the person sufficiently."""

    shows_in_motion: bool = False
    """True if only motion reveals the fault: while the joint stands still, its measurements look normal."""

    at_drive: bool = False
    """True if the guard no longer reaches the drives, so that the time counts until the drives brake by themselves."""

    @property
    def is_borne(self) -> bool:
        """True if the fault has to be tolerated without a stop."""
        return not self.reasons and not self.at_drive

    @property
    def what(self) -> str:
        """Description of the fault as a clause."""
        return (self.injector.__doc__ or "").split(": ", 1)[-1].split(". ")[0].rstrip(".")


ISOLATION, DESCENT, BRIDGE = SafeState.ISOLATION, SafeState.DESCENT, SafeState.BRIDGE
STOP = StopReason

_FAULTS = (
    Fault("F01", of_machine.NonFiniteMeasurement, (STOP.NO_MEASUREMENT,), 4.0, ISOLATION),
    Fault("F02", of_machine.StuckEncoder, (STOP.ENCODER_DEAD, STOP.ENCODERS_PART), 30.0, ISOLATION, True),
    Fault("F03", of_machine.EncoderJump, (STOP.ENCODER_JUMPED,), 4.0, ISOLATION),
    Fault("F03 spike", of_machine.EncoderSpike, (), None, BRIDGE),
    Fault("F04", of_machine.FrozenMeasurement, (STOP.MACHINE_SILENT,), 6.0, ISOLATION),
    Fault("F05", of_machine.DelayedMeasurement, (STOP.MACHINE_SILENT,), 6.0, ISOLATION),
    Fault("F06", of_machine.ReorderedMeasurement, (), None, BRIDGE),
    Fault("F06 twice", of_machine.Doubled, (), None, BRIDGE),
    Fault("F07", of_machine.SignFlip, (STOP.ENCODERS_PART,), 20.0, ISOLATION, True),
    Fault("F08", of_machine.EncoderSlip, (STOP.ENCODERS_PART, STOP.ENCODER_JUMPED, STOP.TOO_FAST), 112.0, ISOLATION),
    # Without a model of inertia, neither of these two faults can be distinguished from a push by the wearer
    # (docs/explanation/safety.md).
    Fault("F09", of_machine.TorqueConstant),
    Fault("F10", of_machine.CurrentBias, (STOP.TORQUE_WRONG,), 250.0, ISOLATION),
    Fault("F11", of_machine.WeakMotor, (STOP.TORQUE_WRONG,), 26.0, ISOLATION),
    Fault("F12", of_machine.ReportedDriveFault, (STOP.DRIVE_FAULT,), 3.0, ISOLATION),
    Fault("F13", of_machine.BusesLost, (STOP.MACHINE_SILENT,), 30.0, ISOLATION, at_drive=True),
    Fault("F14 few", of_control.OccasionalLateTicks, (), None, BRIDGE),
    Fault("F14", of_control.RepeatedLateTicks, (STOP.CONTROL_SILENT,), 20.0, DESCENT),
    Fault("F15", of_control.Hang, (STOP.CONTROL_SILENT,), 10.0, DESCENT),
    Fault("F16", of_control.ControlKilled, (STOP.CONTROL_SILENT,), 5.0, DESCENT),
    Fault("F17", of_machine.GuardDies, (), 30.0, at_drive=True),
    Fault("F25", of_control.WrongArmParameters),
    Fault("F26", of_control.DivergedEstimate),
    Fault("F28", of_person.HiddenWeight),
    Fault("F29", of_person.PersonPush),
    Fault("F30", of_person.StopPressed, (STOP.STOP_PRESSED,), 1.0, DESCENT),
    Fault("F39", of_machine.StopLineOpen, (STOP.DRIVE_FAULT,), 2.0, ISOLATION),
    Fault("control", of_control.WrongTorque),
)

FAULTS: Mapping[str, Fault] = MappingProxyType({fault.id: fault for fault in _FAULTS})
"""All faults, by their identifier such as "F16"."""
