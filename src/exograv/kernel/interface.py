"""What every engine returns: a function on memory that never moves."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Kernel:
    """A compiled function. Write into `inputs`, call, read `outputs`: fixed memory, valid as long as the kernel."""

    name: str
    engine: str
    """"native", or "virtual machine" where native code could not be made."""

    inputs: Mapping[str, np.ndarray]
    """Buffers by argument name; a column (n, 1) is a vector (n,), a matrix is (rows, columns) in Fortran order."""

    outputs: Mapping[str, np.ndarray]
    """Buffers by result name, in the same shapes; overwritten by each call."""

    n_instructions: int
    """Length of the program [-]."""

    code_bytes: int
    """Size of its machine code; of the virtual machine 0."""

    build_s: float
    """Time that compiling or loading took [s]."""

    from_cache: bool
    """Whether the machine code was found ready on disk."""

    evaluate: Callable[[], object]
    """Evaluate once on what stands in `inputs`: the quickest way for a loop. It keeps alive what it needs."""

    again: Callable[[], "Kernel"]
    """Another kernel of the same program with memory of its own, without compiling it anew."""

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
