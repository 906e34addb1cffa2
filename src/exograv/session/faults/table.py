"""Every fault in one table: what injects it, what should find it, how soon, and what should protect the person then.

Identifiers and budgets: docs/safety.md, after the project's fault table.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from exograv.safety.envelope import StopReason
from exograv.safety.guard import SafeState

from . import injectors
from .injectors import Injector


@dataclass(frozen=True)
class Fault:
    """One row."""

    id: str
    """As in docs/safety.md."""

    injector: type[Injector]

    reasons: tuple[StopReason, ...] = ()
    """What the guard may call it; none where it has to be borne without a stop."""

    budget_ms: float | None = None
    """From its beginning to the first command of the safe state; None where it shows only once the arm moves, or where
    nothing has to be found."""

    safe_state: SafeState = SafeState.NONE
    """The least that has to protect the person."""

    shows_in_motion: bool = False
    """Nothing tells it from a joint that stands still."""

    @property
    def what(self) -> str:
        """In a sentence."""
        return (self.injector.__doc__ or "").split(": ", 1)[-1].split(". ")[0].rstrip(".")


ISOLATION, DESCENT, DAMPING, BRIDGE = SafeState.ISOLATION, SafeState.DESCENT, SafeState.DAMPING, SafeState.BRIDGE
STOP = StopReason

_FAULTS = (
    Fault("F01", injectors.NotANumber, (STOP.NO_MEASUREMENT,), 4.0, ISOLATION),
    Fault("F02", injectors.StuckEncoder, (STOP.ENCODER_DEAD, STOP.ENCODERS_PART), 30.0, ISOLATION, True),
    Fault("F03", injectors.Jump, (STOP.ENCODER_JUMPED,), 4.0, ISOLATION),
    Fault("F03 spike", injectors.Spike, (), None, BRIDGE),
    Fault("F04", injectors.Silent, (STOP.MACHINE_SILENT,), 6.0, ISOLATION),
    Fault("F05", injectors.Stale, (STOP.MACHINE_SILENT,), 6.0, ISOLATION),
    Fault("F06", injectors.Reordered, (), None, BRIDGE),
    Fault("F06 twice", injectors.Doubled, (), None, BRIDGE),
    Fault("F07", injectors.SignFlip, (STOP.ENCODERS_PART,), 20.0, ISOLATION, True),
    Fault("F08", injectors.Slip, (STOP.ENCODERS_PART, STOP.ENCODER_JUMPED), 112.0, ISOLATION),
    # Without a model of inertia nothing tells either from a person who pushes (docs/safety.md).
    Fault("F09", injectors.TorqueConstant),
    Fault("F10", injectors.CurrentBias, (STOP.TORQUE_WRONG,), 250.0, DAMPING),
    Fault("F11", injectors.WeakMotor, (STOP.TORQUE_WRONG,), 26.0, DAMPING, True),
    Fault("F12", injectors.DriveFault, (STOP.DRIVE_FAULT,), 3.0, ISOLATION),
    Fault("F13", injectors.BusesLost, (STOP.MACHINE_SILENT,), 30.0, ISOLATION),
    Fault("F14 few", injectors.FewLate, (), None, BRIDGE),
    Fault("F14", injectors.ManyLate, (STOP.CONTROL_SILENT,), 20.0, DESCENT),
    Fault("F15", injectors.Hang, (STOP.CONTROL_SILENT,), 10.0, DESCENT),
    Fault("F16", injectors.Killed, (STOP.CONTROL_SILENT,), 5.0, DESCENT),
    Fault("F17", injectors.GuardDies, (), 30.0, SafeState.NONE),
    Fault("F25", injectors.TenfoldArm),
    Fault("F26", injectors.Diverged),
    Fault("F28", injectors.HiddenWeight),
    Fault("F29", injectors.Push),
    Fault("F30", injectors.StopPressed, (STOP.STOP_PRESSED,), 1.0, DESCENT),
    Fault("F39", injectors.StopLineOpen, (STOP.DRIVE_FAULT,), 2.0, ISOLATION),
    Fault("control", injectors.WrongTorque),
)

FAULTS: Mapping[str, Fault] = MappingProxyType({fault.id: fault for fault in _FAULTS})
"""By identifier."""
