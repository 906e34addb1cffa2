"""Result of each engine: a function on fixed memory."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NativeCall:
    """Compiled function for a caller in C: `function(memory)` evaluates it once, with the copies of `carry`.

    Both addresses hold as long as the kernel that they belong to.
    """

    function: int
    """Address of the function."""

    memory: int
    """Address of its argument: the table of all its buffers."""


@dataclass(frozen=True)
class Kernel:
    """Compiled function. Write into `inputs`, call, read `outputs`: fixed memory, valid as long as the kernel."""

    name: str
    engine: str
    """Engine: "native", or "virtual machine" if native code could not be made."""

    inputs: Mapping[str, np.ndarray]
    """Buffers by argument name; a column (n, 1) is a vector (n,), a matrix is (rows, columns) in Fortran order."""

    outputs: Mapping[str, np.ndarray]
    """Buffers by result name, in the same shapes; overwritten by each call."""

    n_instructions: int
    """Length of the program [-]."""

    code_bytes: int
    """Size of the machine code; 0 on the virtual machine."""

    build_s: float
    """Time that compiling or loading took [s]."""

    from_cache: bool
    """True if the machine code was read from the disk cache."""

    evaluate: Callable[[], object]
    """Function that evaluates once on the contents of `inputs`, fastest in a loop; it keeps its memory alive."""

    again: Callable[[], "Kernel"]
    """Function that returns another kernel of the same program with its own memory, without compiling."""

    native: NativeCall | None = None
    """The same evaluation for a caller in C; None on the virtual machine."""

    def __call__(self) -> Mapping[str, np.ndarray]:
        """Evaluate once on the contents of `inputs` and return `outputs`."""
        self.evaluate()
        return self.outputs

    def of(self, *values: object) -> tuple[np.ndarray, ...]:
        """Return copies of all outputs for these inputs in their order: for set-up and tests, not for the loop."""
        if len(values) != len(self.inputs):
            raise TypeError(f"{self.name} takes {', '.join(self.inputs)}; {len(values)} values were given.")
        for buffer, value in zip(self.inputs.values(), values, strict=True):
            buffer[...] = value
        self.evaluate()
        return tuple(output.copy() for output in self.outputs.values())
