"""Interface of the machine of a steered session: the twin, or a machine on drives."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

from exograv.live.live_processes import LiveResult
from exograv.model.description import RigDescription
from exograv.model.wearer_form import WearerForm
from exograv.options import Side
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig import Rig
from exograv.storage.self_test_pass import MachineKey

from .participants import ParticipantFiles
from .work_progress import CalibrationProgress


@runtime_checkable
class SteeredMachine(Protocol):
    """Machine of one side, or of both arms, with its person and files."""

    description: RigDescription
    people: ParticipantFiles
    torque_max_Nm: tuple[float, ...]
    """Torque limits of the drives [N·m]."""
    calibrating: CalibrationProgress | None
    """Progress of the calibration; None if none runs."""
    is_twin: bool
    """True if no person is in the machine."""
    starts_on_request: bool
    """True if motors are switched on only when an operator makes the machine ready."""

    @property
    def side(self) -> Side:
        """Side of the arm in the machine."""
        ...

    @property
    def form(self) -> WearerForm:
        """Form of the wearer."""
        ...

    def prepare(self) -> ControllerKnowledge:
        """Return the controller's knowledge of the machine; a twin without a calibration file is calibrated first.

        Raises:
            ExogravError: The calibration was refused.
        """
        ...

    def machine_key(self) -> MachineKey | None:
        """Return the key that unlocks a real machine; None for the twin."""
        ...

    def rig(self, prepared: ControllerKnowledge, /) -> Callable[[], Rig]:
        """Return the function that builds the machine. The process that owns the machine calls it."""
        ...

    def recorded(self) -> Mapping[str, Any]:
        """Return what the recording states about the machine."""
        ...

    def hear(self, mode_name: str, /) -> None:
        """Tell a simulated wearer of drives the mode that begins, by its name in lower case."""
        ...

    def ended(self, flown: LiveResult, /) -> str:
        """Take the end of a run. Return a sentence for the operator if the machine has stopped; else an empty text."""
        ...

    def close(self) -> None:
        """Release what the machine holds: processes, buses, and files."""
        ...


MachineOf = Callable[[Side | None], SteeredMachine]
"""Function that returns the machine of a side; without a side that of its first side."""
