"""The kernel on CasADi's virtual machine, through its buffer interface: fast enough for 1 kHz, and everywhere."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np


@dataclass(frozen=True)
class Kernel:
    """A compiled function. Write into `inputs`, call, read `outputs`: fixed memory, valid as long as the kernel."""

    name: str
    inputs: Mapping[str, np.ndarray]
    """Buffers by argument name; a column (n, 1) is a vector (n,), a matrix is (rows, columns) in Fortran order."""

    outputs: Mapping[str, np.ndarray]
    """Buffers by result name, in the same shapes; overwritten by each call."""

    n_instructions: int
    """Length of the program [-]."""

    evaluate: Callable[[], None]
    _keep: tuple[object, ...]
    """The function and its buffer object, which must outlive the callable."""

    def __call__(self) -> Mapping[str, np.ndarray]:
        """Evaluate once on what stands in `inputs`; returns `outputs`."""
        self.evaluate()
        return self.outputs

    def of(self, *values: object) -> tuple[np.ndarray, ...]:
        """Copies of all outputs for these inputs in their order: for set-up and tests, not for the loop."""
        if len(values) != len(self.inputs):
            raise TypeError(f"{self.name} takes {', '.join(self.inputs)}; {len(values)} values were given.")
        for buffer, value in zip(self.inputs.values(), values, strict=True):
            buffer[...] = value
        self.evaluate()
        return tuple(output.copy() for output in self.outputs.values())


def compile(function: ca.Function, bindings: Mapping[str, np.ndarray] | None = None) -> Kernel:
    """Bind a function's arguments and results to memory.

    Args:
        function: Any CasADi function whose arguments are dense.
        bindings: Memory of the caller for some arguments or results by name, in place of new buffers: float64,
            of the right size, contiguous; its elements are taken in CasADi's order, column by column. A C-ordered
            array of the transposed shape has that order.

    Raises:
        ValueError: A binding names no argument, or its memory does not fit.
    """
    bindings = dict(bindings or {})
    # Results are made dense: a structural zero would otherwise shift every entry after it.
    arguments = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    results = [ca.densify(result) for result in function.call(arguments)]
    dense = ca.Function(
        function.name(),
        arguments,
        results,
        [function.name_in(i) for i in range(function.n_in())],
        [function.name_out(i) for i in range(function.n_out())],
        {"cse": True},
    )
    buffer, evaluate = dense.buffer()
    inputs = {dense.name_in(i): _memory(dense.name_in(i), dense.size_in(i), bindings) for i in range(dense.n_in())}
    outputs = {dense.name_out(i): _memory(dense.name_out(i), dense.size_out(i), bindings) for i in range(dense.n_out())}
    if bindings:
        raise ValueError(f"{function.name()} has no argument or result {', '.join(bindings)}.")
    for i, array in enumerate(inputs.values()):
        buffer.set_arg(i, _flat(array))  # pyright: ignore[reportCallIssue] - CasADi's stub knows raw pointers only
    for i, array in enumerate(outputs.values()):
        buffer.set_res(i, _flat(array))  # pyright: ignore[reportCallIssue] - as above
    return Kernel(function.name(), inputs, outputs, dense.n_instructions(), evaluate, (dense, buffer, inputs, outputs))


def _memory(name: str, size: tuple[int, int], bindings: dict[str, np.ndarray]) -> np.ndarray:
    rows, columns = size
    if name in bindings:
        array = bindings.pop(name)
        contiguous = array.flags.c_contiguous or array.flags.f_contiguous
        if array.dtype != np.float64 or array.size != rows * columns or not contiguous or not array.flags.writeable:
            raise ValueError(
                f"{name} needs {rows * columns} contiguous writable float64, not {array.shape} {array.dtype}."
            )
        # The transposed shape in C order is CasADi's order; the same shape in C order is a matrix read across its rows.
        if array.shape == (rows, columns) != (columns, rows) and not array.flags.f_contiguous:
            raise ValueError(f"{name} is a matrix {array.shape} in C order; bind it in Fortran order, or transposed.")
        return array
    return np.zeros(rows) if columns == 1 else np.zeros((rows, columns), order="F")


def _flat(array: np.ndarray) -> memoryview:
    return array.ravel(order="K").data
