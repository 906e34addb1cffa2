"""Physical limit of a core: operations of each program, and the shortest time that they can take."""

from collections import Counter
from typing import Any

import casadi as ca

from exograv.kernel.program import Instruction, Program, straight_line
from peers.tasks.interface import Task

from .peaks import Peaks

KINDS = {
    ca.OP_ADD: "add", ca.OP_SUB: "add", ca.OP_TWICE: "add",
    ca.OP_MUL: "mul", ca.OP_SQ: "mul",
    ca.OP_DIV: "div", ca.OP_INV: "div", ca.OP_SQRT: "sqrt",
    ca.OP_SIN: "sincos", ca.OP_COS: "sincos", ca.OP_TANH: "tanh", ca.OP_EXP: "exp",
    ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow", ca.OP_ATAN2: "atan2",
}  # fmt: skip
"""Kind of each counted operation. Others move, compare or change signs: they count as free, so the limit is low."""

LEAST_ARITHMETIC = {"sincos": 56, "tanh": 20, "exp": 15, "pow": 30, "atan2": 20}
"""Additions and multiplications within a function: sine and cosine as in `kernel.trigonometry`. The others, of the C
library, are assumed low: a polynomial to double precision."""

DIVIDER = ("div", "sqrt")
"""Operations of a separate unit, which runs in parallel with the others."""


def limits_of(task: Task, peaks: Peaks) -> dict[str, Any]:
    """Return counts of a program, and the shortest times [µs] of a single call and of a state in a batch."""
    program = straight_line(task.function)
    counts = operation_counts(program)
    path = critical_path_ns(program, peaks)
    single, batch = (throughput_ns(counts, cost) for cost in (peaks.single_ns, peaks.batch_ns))
    return {
        "name": task.name,
        "operations": dict(counts),
        "instructions": len(program.instructions),
        "critical_path_us": _microseconds(path),
        "throughput_us": _microseconds(single),
        "best_us": _microseconds(max(path, single)),
        "best_batch_us": _microseconds(batch),
        "call_us": _microseconds(peaks.call_ns),
    }


def operation_counts(program: Program) -> Counter[str]:
    """Count operations of each kind; sine and cosine of one angle count as one."""
    counts: Counter[str] = Counter()
    angles = set()
    for instruction in program.instructions:
        kind = KINDS.get(instruction.operation)
        if kind == "sincos":
            angles.add(instruction.operands[0])
        elif kind is not None:
            counts[kind] += 1
    counts["sincos"] = len(angles)
    return +counts


def critical_path_ns(program: Program, peaks: Peaks) -> float:
    """Time of the longest chain of operations that wait for each other [ns]."""
    ready: list[float] = []
    for instruction in program.instructions:
        start = max((ready[operand] for operand in instruction.operands), default=0.0)
        ready.append(start + _latency(instruction, peaks))
    return max(ready, default=0.0)


def throughput_ns(counts: Counter[str], cost: dict[str, float]) -> float:
    """Time of the busiest unit [ns] if no operation ever had to wait for another."""
    return max(arithmetic_count(counts) * cost["muladd"], sum(counts[kind] * cost[kind] for kind in DIVIDER))


def arithmetic_count(counts: Counter[str]) -> int:
    """Return the number of additions and multiplications, including those within functions."""
    within = sum(counts[kind] * least for kind, least in LEAST_ARITHMETIC.items())
    return counts["add"] + counts["mul"] + within


def _latency(instruction: Instruction, peaks: Peaks) -> float:
    return peaks.latency_ns.get(KINDS.get(instruction.operation, ""), 0.0)


def _microseconds(nanoseconds: float) -> float:
    return float(f"{nanoseconds / 1e3:.3g}")
