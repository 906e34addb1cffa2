"""Memory of a kernel: fixed arrays, its own or the caller's, in CasADi's order of elements."""

from collections.abc import Mapping

import numpy as np

from .program import Program


def bound_memory(
    program: Program, bindings: Mapping[str, np.ndarray] | None
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the arrays of all arguments and of all results, by name.

    Raises:
        ValueError: A binding names no argument or result, or its memory does not fit.
    """
    left = dict(bindings or {})
    inputs = {name: _memory(name, size, left) for name, size in program.arguments.items()}
    outputs = {name: _memory(name, size, left) for name, size in program.results.items()}
    if left:
        raise ValueError(f"{program.name} has no argument or result {', '.join(left)}.")
    for result, written in outputs.items():
        for argument, read in inputs.items():
            if np.shares_memory(written, read):
                raise ValueError(f"{result} of {program.name} lies on {argument}; carry it over the call instead.")
    return inputs, outputs


def flat(array: np.ndarray) -> memoryview:
    """Elements of an array in the order of memory."""
    return array.ravel(order="K").data


def numbers(array: np.ndarray) -> "memoryview[float]":
    """Return a view of contiguous float64 elements that reads and writes a Python number in a third of the time."""
    return array.data.cast("B").cast("d")


def _memory(name: str, size: tuple[int, int], bindings: dict[str, np.ndarray]) -> np.ndarray:
    rows, columns = size
    if name in bindings:
        array = bindings.pop(name)
        contiguous = array.flags.c_contiguous or array.flags.f_contiguous
        if array.dtype != np.float64 or array.size != rows * columns or not contiguous or not array.flags.writeable:
            raise ValueError(
                f"{name} needs {rows * columns} contiguous writable float64, not {array.shape} {array.dtype}."
            )
        # The transposed shape in C order has CasADi's order. The same shape in C order would be read across rows.
        in_order = array.shape == size and array.flags.f_contiguous
        turned = array.shape == size[::-1] != size and array.flags.c_contiguous
        if not (array.ndim == 1 or in_order or turned):
            order = "C" if array.flags.c_contiguous else "Fortran"
            raise ValueError(
                f"{name} is a matrix {array.shape} in {order} order; "
                f"bind {size} in Fortran order, or transposed in C order."
            )
        return array
    return np.zeros(rows) if columns == 1 else np.zeros((rows, columns), order="F")


def carried_memory(program: Program, carry: Mapping[str, str] | None) -> tuple[tuple[int, int, int], ...]:
    """Return source and target index of each copy after a call, and its number of elements.

    Indices count arguments, then results.

    Raises:
        ValueError: A name is unknown, or the shapes differ.
    """
    sizes = {**program.arguments, **program.results}
    names = [*program.arguments, *program.results]
    carried = []
    for target, source in (carry or {}).items():
        if target not in program.arguments or source not in sizes:
            raise ValueError(f"{program.name} cannot carry {source} to {target}; it has {', '.join(names)}.")
        rows, columns = sizes[target]
        if sizes[source] != (rows, columns):
            raise ValueError(f"{source} {sizes[source]} does not fit {target} {sizes[target]} of {program.name}.")
        carried.append((names.index(source), names.index(target), rows * columns))
    return tuple(carried)
