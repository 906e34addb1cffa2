"""Batches: one program evaluated for many states, with several lanes per instruction."""

import ctypes
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from . import virtual_machine
from .emission import MemoryLayout
from .native import MachineCode, machine_code
from .object_code import processor
from .program import Program, straight_line
from .recipe import AnyFunction

ELEMENTS = {"float64": "double", "float32": "float"}
LANES = (2, 4, 8, 16, 32)
ALIGNMENT_BYTES = 64
"""Alignment of a cache line and of the widest vectors."""


@dataclass(frozen=True)
class BoundBatch:
    """A batch of a fixed size. Write into `inputs`, call, read `outputs`."""

    inputs: Mapping[str, np.ndarray]
    """Buffers by name: a vector (n,) is (n, size), a matrix (rows, columns, size), a shared argument without `size`."""

    outputs: Mapping[str, np.ndarray]
    """Buffers by result name, in the same shapes; overwritten by each call."""

    size: int
    """Number of states [-]."""

    evaluate: Callable[[], object]
    """Function that evaluates all states on the contents of `inputs`; it keeps a reference to its memory."""

    def __call__(self) -> Mapping[str, np.ndarray]:
        """Evaluate all states and return `outputs`."""
        self.evaluate()
        return self.outputs


@dataclass(frozen=True)
class Batch:
    """A function compiled for many states; `bind` gives it memory."""

    name: str
    engine: str
    """Engine: "native", or "virtual machine" if native code could not be made."""

    lanes: int
    """Number of states that one instruction processes (SIMD lanes)."""

    dtype: np.dtype
    n_instructions: int
    """Length of the program [-]."""

    code_bytes: int
    """Size of the machine code."""

    build_s: float
    """Time that compiling or loading took [s]."""

    from_cache: bool
    """True if the machine code was read from the disk cache."""

    shared: tuple[str, ...]
    """Arguments that are the same for every state."""

    bind: Callable[[int], BoundBatch]
    """Function `bind(size)` that allocates memory for `size` states."""

    def of(self, *values: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return copies of all outputs for these inputs in their order, states along the last axis.

        Raises:
            TypeError: The number of values is wrong.
            ValueError: All arguments are shared, or a value does not fit.
        """
        bound = self.bind(self._size_of(values))
        for buffer, value in zip(bound.inputs.values(), values, strict=True):
            buffer[...] = value
        return tuple(output.copy() for output in bound().values())

    def _size_of(self, values: tuple[np.ndarray, ...]) -> int:
        names = list(self.bind(1).inputs)
        if len(values) != len(names):
            raise TypeError(f"{self.name} takes {', '.join(names)}; {len(values)} values were given.")
        for name, value in zip(names, values, strict=True):
            if name not in self.shared:
                return np.shape(value)[-1]
        raise ValueError(f"All arguments of {self.name} are shared; at least one argument must differ between states.")


def compile_batch(function: AnyFunction, lanes: int, shared: Iterable[str], dtype: str, *, is_native: bool) -> Batch:
    """Compile a function for batches, as `kernel.compile` with lanes.

    Raises:
        KernelError: The function has an unknown operation, which the message names.
        ValueError: A shared name, a number of lanes or an element type is unknown.
    """
    program, shared = straight_line(function), tuple(shared)
    element = ELEMENTS.get(dtype)
    if element is None:
        raise ValueError(f"A batch of {program.name} has float64 or float32 elements, not {dtype}.")
    if lanes not in (0, *LANES):
        raise ValueError(f"A batch of {program.name} has {', '.join(map(str, LANES))} lanes, not {lanes}.")
    missing = [name for name in shared if name not in program.arguments]
    if missing:
        raise ValueError(f"{program.name} has no argument {', '.join(missing)} to share.")
    if not is_native:
        return _on_the_virtual_machine(program, shared, np.dtype(dtype))
    lanes = lanes or processor().lanes * (1 if element == "double" else 2)
    order = [name in shared for name in program.arguments]
    made = machine_code(program, MemoryLayout(lanes, element, frozenset(i for i, same in enumerate(order) if same)))
    native = _NativeBatch(program.outlined(), made, lanes, np.dtype(dtype), shared)
    return Batch(
        program.name, "native", lanes, np.dtype(dtype), program.n_instructions,
        made.n_bytes, made.build_s, made.from_cache, shared, native.bind,
    )  # fmt: skip


@dataclass(frozen=True)
class _NativeBatch:
    program: Program
    made: MachineCode
    lanes: int
    dtype: np.dtype
    shared: tuple[str, ...]

    def bind(self, size: int) -> BoundBatch:
        """Allocate memory for `size` states.

        Raises:
            ValueError: `size` is below 1.
        """
        if size < 1:
            raise ValueError(f"A batch of {self.program.name} needs at least 1 state, not {size}.")
        n_blocks = -(-size // self.lanes)
        # The number of blocks per row is odd: rows a power of two apart would compete for the same cache lines.
        row = (n_blocks | 1) * self.lanes
        inputs = {name: self._memory(name, shape, size, row) for name, shape in self.program.arguments.items()}
        outputs = {name: self._memory("", shape, size, row) for name, shape in self.program.results.items()}
        with np.errstate(over="ignore"):  # single precision has no 1e300; infinity is then right, as in its arithmetic
            constants = self.program.constants.astype(self.dtype)
        arrays = (*inputs.values(), *outputs.values(), constants)
        pointers = (ctypes.c_int64 * (len(arrays) + 1))(*(array.ctypes.data for array in arrays), row)
        alive = (self, arrays, pointers)
        evaluate = self._runner(ctypes.addressof(pointers), n_blocks * self.lanes, alive)
        return BoundBatch(inputs, outputs, size, evaluate)

    def _runner(self, arguments: int, end: int, alive: object) -> Callable[[], object]:
        run = self.made.loaded.address("run")
        # ctypes releases the interpreter lock, so other Python threads run while this one computes.
        function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)(run)
        values = ctypes.c_void_p(arguments), ctypes.c_int64(0), ctypes.c_int64(end)

        def evaluate(_alive: object = alive) -> None:
            function(*values)

        return evaluate

    def _memory(self, name: str, shape: tuple[int, int], size: int, row: int) -> np.ndarray:
        rows, columns = shape
        if name in self.shared:
            return np.zeros(rows, self.dtype) if columns == 1 else np.zeros(shape, self.dtype, order="F")
        spare = ALIGNMENT_BYTES // self.dtype.itemsize
        raw = np.zeros(rows * columns * row + spare, self.dtype)
        start = -raw.ctypes.data % ALIGNMENT_BYTES // self.dtype.itemsize
        aligned = raw[start : start + rows * columns * row]
        if columns == 1:
            return aligned.reshape(rows, row)[:, :size]
        return aligned.reshape(columns, rows, row).transpose(1, 0, 2)[..., :size]


def _on_the_virtual_machine(program: Program, shared: tuple[str, ...], dtype: np.dtype) -> Batch:
    """Return a batch that runs state by state: right on every computer, and slow."""
    one = virtual_machine.compile(program.function)

    def memory(name: str, buffer: np.ndarray, size: int) -> np.ndarray:
        return np.zeros(buffer.shape if name in shared else (*buffer.shape, size), dtype)

    def bind(size: int) -> BoundBatch:
        inputs = {name: memory(name, buffer, size) for name, buffer in one.inputs.items()}
        outputs = {name: memory("", buffer, size) for name, buffer in one.outputs.items()}

        def evaluate() -> None:
            for state in range(size):
                for name, buffer in one.inputs.items():
                    buffer[...] = inputs[name] if name in shared else inputs[name][..., state]
                for name, buffer in one().items():
                    outputs[name][..., state] = buffer

        return BoundBatch(inputs, outputs, size, evaluate)

    return Batch(program.name, one.engine, 1, dtype, one.n_instructions, 0, one.build_s, False, shared, bind)
