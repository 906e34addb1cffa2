"""What this core can do, measured: short native programs of one kind of operation, in chains or side by side."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from exograv import kernel
from exograv.kernel import native
from exograv.kernel.operations import PLACED
from exograv.kernel.program import straight_line

CHAIN = 256
"""Operations of one dependent chain: long against the call."""

SINGLE_SHAPES = ((128, 2), (256, 2), (128, 4))
"""Number and length of independent short chains: many operations at once, as the core can hold; the best counts."""

BATCH_SHAPES, BATCH_STATES = ((16, 4), (32, 4), (16, 8)), 128
"""The same of a batch that stays in the nearest cache."""

CALLS, TRIALS = 100, 9

STEPS: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "add": lambda x, c: x + c,
    "mul": lambda x, c: x * c,
    "div": lambda x, c: x / c,
    "sqrt": lambda x, _: ca.sqrt(x),
    "sincos": lambda x, _: ca.sin(x),
    "tanh": lambda x, _: ca.tanh(x),
    "exp": lambda x, _: ca.exp(x),
    "pow": lambda x, c: x**c,
    "atan2": ca.atan2,
}
"""One operation of each kind, so written that CasADi finds nothing to simplify."""

SIDE_BY_SIDE: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "muladd": lambda x, c: x * c + c,
    "div": STEPS["div"],
    "sqrt": STEPS["sqrt"],
}


@dataclass(frozen=True)
class Peaks:
    """Of one core, double precision."""

    call_ns: float
    """An empty kernel from Python."""

    latency_ns: dict[str, float]
    """Of an operation whose operand is the result of the one before."""

    single_ns: dict[str, float]
    """Of an operation among independent ones, one state; `muladd` is of multiplications and additions in turns."""

    batch_ns: dict[str, float]
    """The same, a state of a batch."""


def measure_peaks() -> Peaks:
    """In a few seconds."""
    x = ca.SX.sym("x")
    empty = ca.Function("empty", [x], [-x])
    call, batch_call = single_ns(empty), _batch_ns(empty)
    latency = {kind: (single_ns(_chain(step)) - call) / CHAIN for kind, step in STEPS.items()}
    single, batch = {}, {}
    for kind, step in SIDE_BY_SIDE.items():
        functions = [wide(step, *shape) for shape in SINGLE_SHAPES]
        single[kind] = min((single_ns(function) - call) / operations(function) for function in functions)
        functions = [wide(step, *shape) for shape in BATCH_SHAPES]
        rounds = [(_batch_ns(function) - batch_call) / operations(function) for function in functions]
        batch[kind] = min(rounds) / BATCH_STATES
    return Peaks(call, latency, single, batch)


def _chain(step: Callable[[ca.SX, ca.SX], ca.SX]) -> ca.Function:
    x, c = ca.SX.sym("x"), ca.SX.sym("c")
    y = x
    for _ in range(CHAIN):
        y = step(y, c)
    return ca.Function("chain", [x, c], [y], ["x", "c"], ["y"])


def wide(step: Callable[[ca.SX, ca.SX], ca.SX], width: int, depth: int) -> ca.Function:
    """Independent chains of as many steps, one after the other."""
    x, c = ca.SX.sym("x", width), ca.SX.sym("c")
    y = x
    for _ in range(depth):
        y = ca.vertcat(*(step(y[i], c) for i in range(width)))
    return ca.Function("wide", [x, c], [y], ["x", "c"], ["y"])


def operations(function: ca.Function) -> int:
    """Those that are left after CasADi's simplifications."""
    return sum(instruction.operation not in PLACED for instruction in straight_line(function).instructions)


def single_ns(function: ca.Function) -> float:
    """Time of a call, one state."""
    compiled = native.compile(function)
    _fill(compiled.inputs.values())
    return _best_ns(compiled.evaluate)


def _batch_ns(function: ca.Function) -> float:
    shared = [name for name in function.name_in() if name == "c"]
    bound = kernel.compile(function, lanes=0, shared=shared).bind(BATCH_STATES)
    _fill(bound.inputs.values())
    return _best_ns(bound.evaluate)


def _fill(buffers: Iterable[np.ndarray]) -> None:
    for buffer in buffers:
        buffer[...] = 1.0000001  # away from 1, where a clever divider would be done at once


def _best_ns(run: Callable[[], object]) -> float:
    """Of several trials the quickest: the core undisturbed."""
    times = []
    for _ in range(TRIALS):
        start = time.perf_counter_ns()
        for _ in range(CALLS):
            run()
        times.append((time.perf_counter_ns() - start) / CALLS)
    return float(np.min(times))
