"""Interface of a simulated wearer to a live run: the form, and at the end the score that only a simulation has."""

from typing import Protocol, runtime_checkable

from jaxtyping import Float
from numpy import ndarray

from exograv.dynamics.parameters import Parameters
from exograv.model.wearer_form import WearerForm
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge


@runtime_checkable
class SimulatedWearer(Protocol):
    """Wearer of a simulated machine. No controller or estimator has access to it."""

    @property
    def form(self) -> WearerForm:
        """Body data and lengths, as an operator measures them."""
        ...

    def left_over_Nm(
        self, known: ControllerKnowledge, x: Parameters, postures: Float[ndarray, "posture joint"] | None = None
    ) -> list[float]:
        """Return the left over with parameters `x`, RMS per joint [N·m]; over held-out postures if none are given."""
        ...
