"""Kernels on CasADi's virtual machine, through its buffer interface: on every computer, and fast enough for 1 kHz."""

import time
from collections.abc import Mapping

import numpy as np

from .interface import Kernel
from .memory import bound_memory, carried_memory, flat
from .program import straight_line
from .recipe import AnyFunction


def compile(
    function: AnyFunction, bindings: Mapping[str, np.ndarray] | None = None, carry: Mapping[str, str] | None = None
) -> Kernel:
    """Compile a function as `kernel.compile` does, for the virtual machine.

    Raises:
        KernelError: The function is not one sequence of scalar operations.
        ValueError: A name is unknown, or a buffer does not fit.
    """
    start = time.perf_counter()
    program = straight_line(function)
    dense = program.function
    inputs, outputs = bound_memory(program, bindings)
    buffer, evaluate = dense.buffer()
    for i, array in enumerate(inputs.values()):
        buffer.set_arg(i, flat(array))  # pyright: ignore[reportCallIssue] - CasADi's stub knows raw pointers only
    for i, array in enumerate(outputs.values()):
        buffer.set_res(i, flat(array))  # pyright: ignore[reportCallIssue] - as above
    carried_memory(program, carry)
    # Elements are copied in the order of memory, whatever shape a binding has.
    copies = [
        ({**inputs, **outputs}[source].ravel(order="K"), inputs[target].ravel(order="K"))
        for target, source in (carry or {}).items()
    ]

    def evaluate_and_carry(_alive: object = (dense, buffer, inputs, outputs)) -> None:
        evaluate()
        for source, target in copies:
            target[...] = source

    return Kernel(
        name=program.name,
        engine="virtual machine",
        inputs=inputs,
        outputs=outputs,
        n_instructions=dense.n_instructions(),
        code_bytes=0,
        build_s=time.perf_counter() - start,
        from_cache=False,
        evaluate=evaluate_and_carry,
        again=lambda: compile(dense, None, carry),
    )
