"""exograv: the CasADi function as machine code."""

from functools import partial

from exograv import __version__, kernel
from exograv.errors import KernelError
from exograv.kernel import native
from peers.tasks.interface import BatchShape, Call, Missing, Task, copy_into


class Native:
    """`kernel.compile` on computers with native code."""

    name = "exograv native"

    def __init__(self):
        self._batches: dict[tuple[str, str], kernel.Batch] = {}

    def version(self) -> str:
        """Return the version of the package."""
        return __version__

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call on fixed memory."""
        try:
            if batch is None:
                single = native.compile(task.function)
                load, read = partial(copy_into, single.inputs), lambda: single.outputs
                return Call(load, single.evaluate, read, (single,), single.code_bytes)
            many = self._many(task, batch)
        except KernelError as error:
            raise Missing(str(error)) from error
        if many.engine != "native":
            raise Missing("no native code on this computer")
        bound = many.bind(batch.size)
        return Call(partial(copy_into, bound.inputs), bound.evaluate, lambda: bound.outputs, (many, bound))

    def _many(self, task: Task, batch: BatchShape) -> kernel.Batch:
        """Compile the batch; one compilation serves all sizes."""
        key = (task.name, batch.dtype)
        if key not in self._batches:
            self._batches[key] = kernel.compile(task.function, lanes=0, shared=task.shared, dtype=batch.dtype)
        return self._batches[key]
