"""Batch memory with one state after the other, as CasADi's own batches have it; ours lie side by side."""

import casadi as ca
import numpy as np

from .interface import BatchShape, State, Task

Memory = dict[str, np.ndarray]


class StateAfterState:
    """Memory of all arguments and results of a batch, and views of it in the layout of the tasks' states."""

    def __init__(self, task: Task, function: ca.Function, batch: BatchShape, *, repeat_shared: bool = False):
        self._shared = task.shared
        self.inputs: Memory = {}
        self.outputs: Memory = {}
        self._views: Memory = {}
        self.results: Memory = {}
        """Results with the states along the last axis."""
        for i in range(function.n_in()):
            name = function.name_in(i)
            count = 1 if name in task.shared and not repeat_shared else batch.size
            self.inputs[name], self._views[name] = _memory(function.size_in(i), count, batch.dtype)
        for i in range(function.n_out()):
            name = function.name_out(i)
            self.outputs[name], self.results[name] = _memory(function.size_out(i), batch.size, batch.dtype)

    def load(self, state: State) -> None:
        """Copy a batch's states into the arguments."""
        for name, view in self._views.items():
            view[...] = state[name][..., None] if name in self._shared else state[name]


def single_memory(size: tuple[int, int]) -> np.ndarray:
    """Return memory for one argument or result, column by column."""
    return np.zeros(size[0]) if size[1] == 1 else np.zeros(size, order="F")


def _memory(size: tuple[int, int], count: int, dtype: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the memory, and a view of it with the states along the last axis."""
    rows, columns = size
    flat = np.zeros(rows * columns * count, dtype)
    view = flat.reshape(count, columns, rows).transpose(2, 1, 0)
    return flat, view[:, 0] if columns == 1 else view
