"""CasADi's virtual machine: the engine where native code is not available."""

from functools import partial
from importlib.metadata import version

from exograv.kernel import virtual_machine
from exograv.kernel.program import straight_line
from peers.tasks.interface import BatchShape, Call, Missing, Task, copy_into
from peers.tasks.memory import StateAfterState


class VirtualMachine:
    """Single states through CasADi's buffers, batches by its `map`, serial or over threads."""

    name = "CasADi virtual machine"

    def version(self) -> str:
        """Return the version of CasADi."""
        return version("casadi")

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call on fixed memory."""
        if batch is not None:
            return _mapped(task, batch)
        single = virtual_machine.compile(task.function)
        return Call(partial(copy_into, single.inputs), single.evaluate, lambda: single.outputs, (single,))


def _mapped(task: Task, batch: BatchShape) -> Call:
    if batch.dtype != "float64":
        raise Missing("computes in double precision")
    function = straight_line(task.function).function
    # The cost of repeating shared arguments in the map is too small to measure.
    memory = StateAfterState(task, function, batch, repeat_shared=True)
    mapped = function.map(batch.size)
    buffer, run = mapped.buffer()
    for i, array in enumerate(memory.inputs.values()):
        buffer.set_arg(i, array.data)  # pyright: ignore[reportCallIssue] - CasADi's stub knows raw pointers only
    for i, array in enumerate(memory.outputs.values()):
        buffer.set_res(i, array.data)  # pyright: ignore[reportCallIssue] - as above
    return Call(memory.load, run, lambda: memory.results, (buffer, memory))
