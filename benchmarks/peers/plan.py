"""Plan of a run, in full and in a minute (`--quick`)."""

from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from typing import Literal

from peers.opponents import (
    AdamCasadi,
    AdamJax,
    Frax,
    GeneratedC,
    GeneratedCLanes,
    JaxAhead,
    JaxByHand,
    JaxTranslated,
    Mujoco,
    Native,
    Pinocchio,
    VirtualMachine,
)
from peers.tasks import arm_tasks, machines
from peers.tasks.interface import BatchShape, Task

from .measurement import Measurement
from .rounds import Effort

Section = Literal["single", "batch"]
"""Group of rows: single states, or batches on one core. Each group runs in its own process."""

SIZES = (1, 64, 1024, 16384)
CHAIN = (4, 8, 12, 16, 20, 24, 28)
CHAIN_QUICK = (4, 12, 20)
IN_CHAIN = (Native.name, VirtualMachine.name, GeneratedC.name, Pinocchio.name, Mujoco.name)
"""Implementations in the plot of cost against joints."""

SINGLE_FULL, SINGLE_QUICK = Effort(40, 0.03), Effort(10, 0.005)
BATCH_FULL, BATCH_QUICK = Effort(12, 0.03), Effort(4, 0.01)

QUICK = "left out of --quick: "
SLOW_JAX = "JAX compiles it for half a minute; a full run does"
SLOW_C = "the C compiler takes seconds; a full run does"
ONCE = "JAX compiles it for half a minute, so only at 1024 states in double precision"


@cache
def task(name: str) -> Task:
    """Return a task by the name of its row."""
    quantity, n = name.rsplit("_", 1)
    if quantity == "rnea_chain":
        return arm_tasks.tree_task(machines.chain(int(n)), name, "rnea")
    makers: dict[str, Callable[[int], Task]] = {
        "torque_gradient": arm_tasks.torque_gradient_task,
        "tick_aligned": arm_tasks.aligned_tick_task,
        "tick_general": arm_tasks.general_tick_task,
    }
    if quantity in makers:
        return makers[quantity](int(n))
    return arm_tasks.tree_task(arm_tasks.machine_and_assembly(int(n))[1].exo, name, quantity)


def measurements(section: Section, quick: bool) -> list[Measurement]:
    """Return the measurements of one section, in order."""
    return list(_single(quick) if section == "single" else _batches(quick))


def _single(quick: bool) -> Iterator[Measurement]:
    effort = SINGLE_QUICK if quick else SINGLE_FULL
    for name in (
        "rnea_4", "rnea_7", "regressor_7", "rnea_derivatives_7", "torque_gradient_4", "torque_gradient_7",
        "tick_aligned_4", "tick_aligned_7", "tick_general_4", "tick_general_7",
    ):  # fmt: skip
        yield Measurement(partial(task, name), name, None, effort, _left_out_of_single(name) if quick else {})
    for n in CHAIN_QUICK if quick else CHAIN:
        name = f"rnea_chain_{n}"
        yield Measurement(partial(task, name), name, None, effort, {}, IN_CHAIN)


def _left_out_of_single(name: str) -> dict[str, str]:
    left_out = {AdamJax.name: QUICK + "it compiles for seconds"}
    if name in ("regressor_7", "rnea_derivatives_7", "torque_gradient_4", "tick_aligned_4"):
        left_out |= dict.fromkeys(
            (JaxByHand.name, JaxAhead.name, JaxTranslated.name), QUICK + "JAX shows two such rows"
        )
    if name in ("rnea_4", "torque_gradient_7"):
        left_out[JaxTranslated.name] = QUICK + "JAX by hand is faster there"
    if name.startswith("tick_general"):
        left_out[JaxTranslated.name] = QUICK + SLOW_JAX
    if name == "tick_general_7":
        left_out[GeneratedC.name] = QUICK + SLOW_C
    return left_out


def _batches(quick: bool) -> Iterator[Measurement]:
    effort = BATCH_QUICK if quick else BATCH_FULL
    for name in ("rnea_7", "torque_gradient_7", "tick_aligned_7", "tick_general_4"):
        for batch in _shapes(quick):
            left_out = _left_out_of_batch(name, batch, quick)
            yield Measurement(partial(task, name), f"batch_{name}_{batch.suffix}", batch, effort, left_out)


def _shapes(quick: bool) -> Iterable[BatchShape]:
    if not quick:
        return [BatchShape(size, dtype) for dtype in ("float64", "float32") for size in SIZES]
    return [*(BatchShape(size, "float64") for size in SIZES), BatchShape(1024, "float32")]


def _left_out_of_batch(name: str, batch: BatchShape, quick: bool) -> dict[str, str]:
    left_out = {}
    is_middle = batch == BatchShape(1024, "float64")
    if name == "tick_general_4" and not (is_middle and not quick):
        left_out[JaxTranslated.name] = QUICK + SLOW_JAX if quick else ONCE
    if quick and name == "tick_general_4":
        left_out |= dict.fromkeys((GeneratedC.name, GeneratedCLanes.name), QUICK + SLOW_C)
    if quick and (batch.size == 16384 or (name == "tick_general_4" and batch.size > 64)):
        left_out[VirtualMachine.name] = QUICK + "a call takes up to a second"
    if quick and not (is_middle and name == "rnea_7"):
        left_out |= dict.fromkeys(
            (JaxByHand.name, JaxAhead.name, Frax.name), QUICK + "JAX compiles each anew; see RNEA at 1024"
        )
    if quick:
        left_out |= dict.fromkeys(
            (JaxTranslated.name, AdamJax.name, AdamCasadi.name), QUICK + "it compiles for seconds"
        )
    return left_out
