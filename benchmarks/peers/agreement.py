"""Agreement of an implementation with the reference, checked before it is timed."""

from collections.abc import Mapping, Sequence

import numpy as np

from exograv.kernel import virtual_machine
from peers.tasks.arm_tasks import stacked
from peers.tasks.interface import BatchShape, Call, Missing, Task

TOLERANCE = {"float64": 1e-9, "float32": 1e-4}
"""Largest allowed difference relative to the largest result of its kind. Rounding of some thousand operations in
another order, amplified by the conditioning of the cuffs' Hessian, stays well below it."""

CHECKED = 32
"""Number of states compared at each end of a batch: the end may lie in the middle of a vector."""


class Reference:
    """Results of CasADi's virtual machine for a task's states."""

    def __init__(self, task: Task):
        self._task = task
        single = virtual_machine.compile(task.function)
        self._results = []
        for state in task.states:
            for name, buffer in single.inputs.items():
                buffer[...] = state[name]
            self._results.append({name: single()[name].copy() for name in task.compared})

    def error_of(self, call: Call, batch: BatchShape | None) -> float:
        """Return the largest difference, relative to the largest result of its kind.

        Raises:
            Missing: The implementation disagrees; it must not be timed.
        """
        which, found = self._singles(call) if batch is None else self._batch(call, batch)
        error = 0.0
        for name in self._task.compared:
            expected = np.array([self._results[k][name] for k in which])
            actual = np.array([np.asarray(result[name], float).reshape(expected.shape[1:]) for result in found])
            scale = np.abs(expected).max()
            difference = np.abs(actual - expected).max() / (scale if scale > 0.0 else 1.0)
            error = max(error, float(difference)) if np.isfinite(difference) else np.inf
        limit = TOLERANCE["float64" if batch is None else batch.dtype]
        if error > limit:
            raise Missing(f"disagrees with the reference by {error:.1e} (allowed {limit:.0e}), so it is not timed")
        return error

    def _singles(self, call: Call) -> tuple[Sequence[int], Sequence[Mapping[str, np.ndarray]]]:
        """Return the indices of the states, and the results of each."""
        found = []
        for state in self._task.states:
            call.load(state)
            call.run()
            results = call.read()
            found.append({name: np.array(results[name]) for name in self._task.compared})
        return range(len(found)), found

    def _batch(self, call: Call, batch: BatchShape) -> tuple[Sequence[int], Sequence[Mapping[str, np.ndarray]]]:
        """Return indices and results for both ends of a batch."""
        call.load(stacked(self._task, batch.size, 0))
        call.run()
        results, different = call.read(), min(batch.size, len(self._task.states))
        ends = sorted({*range(min(CHECKED, batch.size)), *range(max(0, batch.size - CHECKED), batch.size)})
        found = [{name: np.array(results[name][..., k]) for name in self._task.compared} for k in ends]
        return [k % different for k in ends], found
