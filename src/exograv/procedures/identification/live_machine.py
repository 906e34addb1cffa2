"""Machine with its wearer, ready for the processes of a live run."""

from collections.abc import Callable
from dataclasses import dataclass

from exograv.model.wearer_form import WearerForm
from exograv.rig import Rig

from .controller_knowledge import ControllerKnowledge
from .simulated_wearer import SimulatedWearer


@dataclass(frozen=True)
class LiveMachine:
    """Inputs of the processes of a live run."""

    form: WearerForm
    """Body data and lengths, as an operator measures them."""
    known: ControllerKnowledge
    connect: Callable[[], Rig]
    """Function that opens the machine, called in the process that owns it."""
    period_s: float
    wearer: SimulatedWearer
    self_test: str | None = None
    """Result of the self-test; None if it was skipped."""
