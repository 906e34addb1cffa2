"""Peak rates of this core, measured with short native programs of one operation, in chains or side by side."""

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
"""Operations of one dependent chain: long compared with the call."""

SINGLE_SHAPES = ((128, 2), (256, 2), (128, 4))
"""Number and length of independent short chains, to fill all units of the core; the best shape counts."""

BATCH_SHAPES, BATCH_STATES = ((16, 4), (32, 4), (16, 8)), 128
"""Shapes and number of states of a batch that stays in the nearest cache."""

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
"""Operation of each kind, written so that CasADi finds nothing to simplify."""

SIDE_BY_SIDE: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "muladd": lambda x, c: x * c + c,
    "div": STEPS["div"],
    "sqrt": STEPS["sqrt"],
}


@dataclass(frozen=True)
class Peaks:
    """Peak rates of one core in double precision."""

    call_ns: float
    """Time of an empty kernel, called from Python."""

    latency_ns: dict[str, float]
    """Latency of an operation whose operand is the result of the one before."""

    single_ns: dict[str, float]
    """Time per independent operation, one state; `muladd` alternates multiplications and additions."""

    batch_ns: dict[str, float]
    """Time per independent operation and state in a batch."""


def measure_peaks() -> Peaks:
    """Measure all rates; takes a few seconds."""
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
    """Return a function of `width` independent chains with `depth` steps each, one chain after the other."""
    x, c = ca.SX.sym("x", width), ca.SX.sym("c")
    y = x
    for _ in range(depth):
        y = ca.vertcat(*(step(y[i], c) for i in range(width)))
    return ca.Function("wide", [x, c], [y], ["x", "c"], ["y"])


def operations(function: ca.Function) -> int:
    """Return the number of operations that remain after CasADi's simplifications."""
    return sum(instruction.operation not in PLACED for instruction in straight_line(function).instructions)


def single_ns(function: ca.Function) -> float:
    """Time of a call with one state [ns]."""
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
        buffer[...] = 1.0000001  # not 1: a divider may end early on simple numbers


def _best_ns(run: Callable[[], object]) -> float:
    """Return the shortest time of several trials [ns]: that of the undisturbed core."""
    times = []
    for _ in range(TRIALS):
        start = time.perf_counter_ns()
        for _ in range(CALLS):
            run()
        times.append((time.perf_counter_ns() - start) / CALLS)
    return float(np.min(times))
