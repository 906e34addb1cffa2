"""A machine with its wearer, ready for the processes of a live run."""

from collections.abc import Callable
from dataclasses import dataclass

from exograv.model.wearer_form import WearerForm
from exograv.rig import Rig

from .controller_knowledge import ControllerKnowledge
from .simulated_wearer import SimulatedWearer


@dataclass(frozen=True)
class LiveMachine:
    """What the processes of a live run are built from."""

    form: WearerForm
    """Body data and lengths, as an operator measures them."""
    known: ControllerKnowledge
    connect: Callable[[], Rig]
    """Makes the machine, in the process that owns it."""
    period_s: float
    wearer: SimulatedWearer
    self_test: str | None = None
    """How the self-test went; absent where it was skipped."""
