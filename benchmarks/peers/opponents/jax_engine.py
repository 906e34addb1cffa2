"""JAX parts that its opponents share. Arguments wait on the device; the result is awaited but not converted."""

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np

from peers.tasks.interface import BatchShape, Call, Missing, State, Task, imported


def jax_module() -> Any:
    """Return JAX in double precision.

    Raises:
        Missing: JAX is not installed.
    """
    jax = imported("jax")
    jax.config.update("jax_enable_x64", True)
    # To hand a small program to another thread takes twice the program's own time here.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    return jax


def jax_version() -> str:
    """Return the version of JAX.

    Raises:
        Missing: JAX is not installed.
    """
    imported("jax")
    return version("jax")


def jitted(
    function: Callable[..., Sequence[Any]],
    names: Sequence[str],
    task: Task,
    batch: BatchShape | None,
    axis: int,
    *,
    is_ahead: bool = False,
) -> Call:
    """Return a call of `jax.jit(function)`; for a batch, of its `jax.vmap` with the states along `axis`.

    Args:
        function: Takes the task's arguments in their order, gives its results in the order of `names`.
        names: Names of the results.
        task: Task whose arguments are taken.
        batch: None for single states.
        axis: 0 is the custom of JAX; −1 keeps each number's states side by side, as our batches do.
        is_ahead: True to compile when the first state is loaded, and to call the compiled program itself.
    """
    jax = jax_module()
    arguments = [task.function.name_in(i) for i in range(task.function.n_in())]
    dtype = np.dtype("float64" if batch is None else batch.dtype)
    many = [] if batch is None else [name for name in arguments if name not in task.shared]
    if batch is not None:
        axes = tuple(axis if name in many else None for name in arguments)
        function = jax.vmap(function, in_axes=axes, out_axes=axis)
    compiled = jax.jit(function)
    held: dict[str, Any] = {"call": compiled}

    def load(state: State) -> None:
        held["arguments"] = [jax.device_put(_with_axis(state[name], axis, dtype, name in many)) for name in arguments]
        if is_ahead and held["call"] is compiled:
            held["call"] = compiled.lower(*held["arguments"]).compile()

    def run() -> None:
        results = held["results"] = held["call"](*held["arguments"])
        results[-1].block_until_ready()

    def read() -> Mapping[str, np.ndarray]:
        return {
            name: np.moveaxis(np.asarray(result), axis, -1) if batch is not None else np.asarray(result)
            for name, result in zip(names, held["results"], strict=True)
        }

    return Call(load, run, read)


def _with_axis(values: np.ndarray, axis: int, dtype: np.dtype, batched: bool) -> np.ndarray:
    moved = np.moveaxis(values, -1, axis) if batched else values
    return np.ascontiguousarray(moved, dtype)


def refuse_single_precision(batch: BatchShape | None) -> None:
    """Refuse single precision, for packages whose models are in double precision.

    Raises:
        Missing: Single precision is asked for.
    """
    if batch is not None and batch.dtype != "float64":
        raise Missing("its model is in double precision")
