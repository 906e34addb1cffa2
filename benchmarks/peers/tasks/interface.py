"""Interfaces of a task and of an opponent, which makes one call out of a task or states why it cannot."""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, runtime_checkable

import casadi as ca
import numpy as np

from exograv.model.tree import Tree

from .programs import AlignedTick

State = Mapping[str, np.ndarray]
"""Values by argument name. In a batch the states lie along the last axis; shared values have no such axis."""

Quantity = Literal["rnea", "regressor", "rnea_derivatives", "torque_gradient", "tick_aligned", "tick_general"]


@dataclass(frozen=True)
class Task:
    """Computation that is the same in every implementation."""

    name: str
    quantity: Quantity
    function: ca.Function
    """Definition of the computation."""

    tree: Tree
    """Machine of the computation."""

    states: tuple[State, ...]
    shared: tuple[str, ...]
    """Arguments that are the same for all states of a batch."""

    compared: tuple[str, ...]
    """Results in which every implementation must agree."""

    aligned: AlignedTick | None = None
    """Parts of the aligned tick, for implementations that are written by hand."""


@dataclass(frozen=True)
class BatchShape:
    """Number of states of a batch and its precision; one core computes them."""

    size: int
    dtype: Literal["float64", "float32"]

    @property
    def suffix(self) -> str:
        """Suffix of the row's name."""
        return f"{self.size}_{self.dtype.replace('float', 'f')}_one_core"


@dataclass(frozen=True)
class Call:
    """Implementation of one task, ready to run."""

    load: Callable[[State], None]
    """Function that puts a state where `run` finds it; not timed."""

    run: Callable[[], object]
    """Function that computes; this is timed."""

    read: Callable[[], Mapping[str, np.ndarray]]
    """Function that returns the results of the last run by name, in NumPy's shapes; not timed."""

    keep: tuple[object, ...] = field(default=())
    """Objects that must outlive the call."""

    code_bytes: int | None = None
    """Size of the machine code, if known."""


class Missing(Exception):  # noqa: N818 - not an error: an opponent that cannot take part
    """An opponent cannot compute this here; the message is the reason that is reported."""


@runtime_checkable
class Opponent(Protocol):
    """Implementation that takes part."""

    name: str

    def version(self) -> str:
        """Return the version of the engine that computes."""
        ...

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Make the task ready, for single states or for a batch.

        Raises:
            Missing: The implementation cannot do this task.
        """
        ...


def imported(module: str) -> Any:
    """Import a package that may be absent.

    Raises:
        Missing: The package is absent or broken.
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
        Missing: A batch is asked for.
    """
    if batch is not None:
        raise Missing("computes one state a call from Python")


def copy_into(buffers: Mapping[str, np.ndarray], state: State) -> None:
    """Copy the values of a state into buffers of the same names."""
    for name, buffer in buffers.items():
        buffer[...] = state[name]
