"""What is timed, and what an opponent is: it makes one call out of a task, or says why it cannot."""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, runtime_checkable

import casadi as ca
import numpy as np

from exograv.model.tree import Tree

from .programs import AlignedTick

State = Mapping[str, np.ndarray]
"""Values by argument name. In a batch the states lie along the last axis; what they share has no such axis."""

Quantity = Literal["rnea", "regressor", "rnea_derivatives", "torque_gradient", "tick_aligned", "tick_general"]


@dataclass(frozen=True)
class Task:
    """One thing to compute, the same in every implementation."""

    name: str
    quantity: Quantity
    function: ca.Function
    """Its definition."""

    tree: Tree
    """The machine it is about."""

    states: tuple[State, ...]
    shared: tuple[str, ...]
    """Arguments that are the same for all states of a batch."""

    compared: tuple[str, ...]
    """Results that every implementation has to agree in."""

    aligned: AlignedTick | None = None
    """Of the aligned tick: what it is made of, for those who write it by hand."""


@dataclass(frozen=True)
class BatchShape:
    """How many states at once, in which precision; one core computes them."""

    size: int
    dtype: Literal["float64", "float32"]

    @property
    def suffix(self) -> str:
        """Of the row's name."""
        return f"{self.size}_{self.dtype.replace('float', 'f')}_one_core"


@dataclass(frozen=True)
class Call:
    """One implementation of one task, ready to run."""

    load: Callable[[State], None]
    """Put a state where `run` finds it; not timed."""

    run: Callable[[], object]
    """Compute; this is what is timed."""

    read: Callable[[], Mapping[str, np.ndarray]]
    """Results of the last run by name, in NumPy's shapes; not timed."""

    keep: tuple[object, ...] = field(default=())
    """What must outlive the call."""

    code_bytes: int | None = None
    """Size of its machine code, where that is known."""


class Missing(Exception):  # noqa: N818 - not an error: an opponent that cannot take part
    """An opponent cannot compute this here; the message is the reason that is reported."""


@runtime_checkable
class Opponent(Protocol):
    """An implementation."""

    name: str

    def version(self) -> str:
        """Of what does the work."""
        ...

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Make the task ready, for single states or for a batch.

        Raises:
            Missing: It cannot.
        """
        ...


def imported(module: str) -> Any:
    """A package that may be absent.

    Raises:
        Missing: It is absent, or broken.
    """
    try:
        return importlib.import_module(module)
    except (ImportError, OSError, AttributeError) as error:
        if isinstance(error, ModuleNotFoundError):
            raise Missing(f"{error.name} is not installed; make bench-setup installs it") from error
        raise Missing(f"{module} cannot be imported: {error}") from error


def only(task: Task, *quantities: Quantity) -> None:
    """Refuse other tasks.

    Raises:
        Missing: The task is not among them.
    """
    if task.quantity not in quantities:
        raise Missing("has no such function")


def only_single(batch: BatchShape | None) -> None:
    """Refuse batches.

    Raises:
        Missing: It is one.
    """
    if batch is not None:
        raise Missing("computes one state a call from Python")


def copy_into(buffers: Mapping[str, np.ndarray], state: State) -> None:
    """Fill buffers of the same names."""
    for name, buffer in buffers.items():
        buffer[...] = state[name]
