"""Table of all faults: injector, permitted stop reasons, detection budget, and the safe state that protects the person.

Identifiers and budgets follow the project's fault table. `make docs` writes a page of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

from . import control_faults as of_control
from . import lying_faults as of_lies
from . import machine_faults as of_machine
from . import person_faults as of_person
from .acceptance import HAND_MAX_M_S, MOTION, Measure
from .injector import Injector

AFTER_MS = 1300
"""Time flown after the last onset [ms]. The hand is fastest within the first second of a descent."""

SPIKE_STEP_NM = 0.15 + 1e-9
"""Largest change of a command per tick, with rounding [N·m]."""


@dataclass(frozen=True)
class Fault:
    """Row of the fault table: one fault, how it must be detected, and the safe state that must follow."""

    id: str
    """Identifier, such as "F16"."""

    injector: type[Injector]

    reasons: tuple[StopReason, ...] = ()
    """Stop reasons that the guard may report; empty if the fault has to be tolerated without a stop."""

    budget_ms: float | None = None
    """Time from the fault's beginning to the first command of the safe state [ms]; None where no detection is
    required."""

    safe_state: SafeState = SafeState.NONE
    """Weakest safe state that protects the person sufficiently."""

    at_drive: bool = False
    """True if the guard no longer reaches the drives, so that the time counts until the drives brake by themselves."""

    limits: Mapping[Measure, float] = field(default_factory=dict)
    """Largest permitted figures beside the budget."""

    one_suffices: bool = False
    """True if a relaxed flight that keeps either the budget or the limits is accepted."""

    told_suffices: bool = False
    """True if a message of the drift monitor to the operator counts as detection, as the descent does."""

    after_ms: int = AFTER_MS
    """Time flown after the onset [ms]. Slow faults need longer flights."""

    @property
    def is_borne(self) -> bool:
        """True if the fault has to be tolerated without a stop."""
        return not self.reasons and not self.at_drive

    @property
    def what(self) -> str:
        """Description of the fault as a clause."""
        first, *_ = (self.injector.__doc__ or "").split("\n\n")
        return first.split(": ", 1)[-1].split(". ")[0].rstrip(".")


ISOLATION, DESCENT, BRIDGE = SafeState.ISOLATION, SafeState.DESCENT, SafeState.BRIDGE
STOP = StopReason

MOVED = (STOP.TORQUE_WRONG, STOP.TOO_FAST, STOP.PAST_A_STOP, STOP.NOT_THIS_ARM)
"""Reasons of a stop after a torque or a load that differs from the expected one: the torque itself, or its motion."""

_FAULTS = (
    Fault("F01", of_machine.NonFiniteMeasurement, (STOP.NO_MEASUREMENT,), 4.0, ISOLATION),
    Fault("F02", of_machine.StuckEncoder, (STOP.ENCODER_DEAD, STOP.ENCODERS_PART), 30.0, ISOLATION, limits=MOTION),
    Fault("F03", of_machine.EncoderJump, (STOP.ENCODER_JUMPED,), 4.0, ISOLATION),
    Fault("F03 spike", of_machine.EncoderSpike, (), None, BRIDGE, limits={Measure.STEP: SPIKE_STEP_NM}),
    Fault("F04", of_machine.FrozenMeasurement, (STOP.MACHINE_SILENT,), 6.0, ISOLATION),
    Fault("F05", of_machine.DelayedMeasurement, (STOP.MACHINE_SILENT,), 6.0, ISOLATION),
    Fault("F06", of_machine.ReorderedMeasurement, (), None, BRIDGE),
    Fault("F06 twice", of_machine.Doubled, (), None, BRIDGE),
    Fault("F07", of_machine.SignFlip, (STOP.ENCODERS_PART,), 20.0, ISOLATION, limits=MOTION),
    Fault("F08", of_machine.EncoderSlip, (STOP.ENCODERS_PART, STOP.ENCODER_JUMPED, STOP.TOO_FAST), 12.0, ISOLATION),
    Fault("F09", of_machine.TorqueConstant, MOVED, 10.0, SafeState.DAMPING),
    Fault("F10", of_machine.CurrentBias, (STOP.TORQUE_WRONG,), 250.0, ISOLATION),
    Fault("F11", of_machine.WeakMotor, (STOP.TORQUE_WRONG,), 26.0, ISOLATION),
    Fault("F12", of_machine.ReportedDriveFault, (STOP.DRIVE_FAULT,), 3.0, ISOLATION),
    Fault("F13", of_machine.BusesLost, (STOP.MACHINE_SILENT,), 30.0, ISOLATION, at_drive=True),
    Fault("F14 few", of_control.OccasionalLateTicks, (), None, BRIDGE),
    Fault("F14", of_control.RepeatedLateTicks, (STOP.CONTROL_SILENT,), 6.0, DESCENT),
    Fault("F15", of_control.Hang, (STOP.CONTROL_SILENT,), 10.0, DESCENT),
    Fault("F16", of_control.ControlKilled, (STOP.CONTROL_SILENT,), 5.0, DESCENT),
    Fault("F17", of_machine.GuardDies, (), 10.0, at_drive=True),
    Fault("F25", of_control.WrongArmParameters, limits=MOTION),
    Fault(
        "F26", of_control.DivergedEstimate, limits={Measure.TORQUE_CHANGE: 5.0 + 1e-6, Measure.ARM_BOUND: 1.0}
    ),
    Fault(
        "F28", of_person.HiddenWeight, MOVED, 500.0, DESCENT, limits={Measure.DRIFT: 5.0}, one_suffices=True
    ),
    Fault("F29", of_person.PersonPush, limits={Measure.POWER: 10.0}),
    Fault("F30", of_person.StopPressed, (STOP.STOP_PRESSED,), 1.0, DESCENT),
    Fault("F39", of_machine.StopLineOpen, (STOP.DRIVE_FAULT,), 2.0, ISOLATION),
    Fault("control", of_control.WrongTorque),
)  # fmt: skip

LIES = (*MOVED, STOP.DRIFTED, STOP.MODEL_LOST, STOP.ENCODERS_PART, STOP.ENCODER_JUMPED, STOP.ASTRAY)
"""Reasons of a stop after a slow change of the machine or of the arm in it."""

FROZEN = (STOP.MACHINE_SILENT, STOP.ENCODER_DEAD, STOP.ENCODERS_PART, STOP.TORQUE_WRONG)
"""Reasons of a stop after signals that no longer change."""

SLOW: Mapping[Measure, float] = MappingProxyType({Measure.HAND: HAND_MAX_M_S})

_LATER = (
    Fault("F41", of_lies.FrozenMachine, FROZEN, 50.0, DESCENT, limits=SLOW),
    Fault("F41 board", of_lies.FrozenBoard, (*FROZEN, STOP.DRIVE_FAULT), 100.0, ISOLATION, limits=SLOW),
    Fault("F45", of_lies.TiltingBase, LIES, 60e3, DESCENT, limits=SLOW, told_suffices=True, after_ms=61_000),
    Fault("F46", of_lies.TorqueConstantDrift, LIES, 30e3, DESCENT, limits=SLOW, told_suffices=True, after_ms=31_000),
    Fault("F47", of_lies.CommonEncoderSlip, limits=SLOW, after_ms=15_000),
    Fault("F48", of_lies.OtherPerson, LIES, 20e3, DESCENT, limits=SLOW, after_ms=21_000),
    Fault("F49", of_lies.CuffSlide, LIES, 5e3, DESCENT, limits=SLOW, told_suffices=True, after_ms=6_000),
    Fault("F50", of_lies.WeightDropped, limits=SLOW, after_ms=3_000),
    Fault("F51", of_lies.WeightTakenUp, limits=SLOW, after_ms=3_000),
)  # fmt: skip

EARLIER: Mapping[str, Fault] = MappingProxyType({fault.id: fault for fault in _FAULTS})
"""Faults whose scenarios keep their random numbers when a row is added to `LATER`."""

LATER: Mapping[str, Fault] = MappingProxyType({fault.id: fault for fault in _LATER})
"""Faults with random numbers of their own."""

FAULTS: Mapping[str, Fault] = MappingProxyType({**EARLIER, **LATER})
"""All faults, by their identifier such as "F16"."""
