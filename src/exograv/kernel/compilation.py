"""Which engine runs a function: native code where it can be made, CasADi's virtual machine elsewhere."""

import logging
import os
from collections.abc import Iterable, Mapping
from functools import cache
from typing import overload

import casadi as ca
import numpy as np

from exograv.errors import KernelError

from . import native, object_code, virtual_machine
from .batch import Batch, compile_batch
from .interface import Kernel

ENGINE_VARIABLE = "EXOGRAV_KERNEL"
"""Set to `virtual-machine` it keeps native code away, to compare the two or to leave a suspicion behind."""

_log = logging.getLogger(__name__)


@overload
def compile(
    function: ca.Function, bindings: Mapping[str, np.ndarray] | None = None, *, carry: Mapping[str, str] | None = None
) -> Kernel: ...


@overload
def compile(
    function: ca.Function, *, lanes: int, shared: Iterable[str] = (), dtype: type | str = np.float64
) -> Batch: ...


def compile(
    function: ca.Function,
    bindings: Mapping[str, np.ndarray] | None = None,
    *,
    carry: Mapping[str, str] | None = None,
    lanes: int | None = None,
    shared: Iterable[str] = (),
    dtype: type | str = np.float64,
) -> Kernel | Batch:
    """Bind a function's arguments and results to memory, or with `lanes` make it ready for batches.

    Args:
        function: Any CasADi function that is one line of scalar operations.
        bindings: Memory of the caller for some arguments or results by name, in place of new buffers: float64,
            of the right size, contiguous; its elements are taken in CasADi's order, column by column. A C-ordered
            array of the transposed shape has that order.
        carry: Arguments that are overwritten after each call, for the next one, by a result or another argument; one
            after another in the order given.
        lanes: States that one instruction works on: 2, 4, 8, 16 or 32, or 0 for the widest of this processor.
        shared: Of a batch, arguments that are the same for every state.
        dtype: Of a batch's elements, float64 or float32.

    Raises:
        KernelError: An operation is not known; it is named.
        ValueError: A name is not known, or memory does not fit.
    """
    if lanes is None and (shared or np.dtype(dtype) != np.float64):
        raise ValueError(f"{function.name()}: shared and dtype belong to batches; give lanes, 0 for the widest.")
    if lanes is not None and (bindings or carry):
        raise ValueError(f"{function.name()}: a batch has memory of its own, without bindings or carry.")
    if isinstance(shared, str):
        raise ValueError(f'{function.name()}: shared is a list of names; write ["{shared}"].')
    if lanes is not None:
        return compile_batch(function, lanes, shared, np.dtype(dtype).name, is_native=native_is_possible())
    engine = native if native_is_possible() else virtual_machine
    return engine.compile(function, bindings, carry)


@cache
def native_is_possible() -> bool:
    """Whether this computer can make native code; if not it is said once."""
    asked = os.environ.get(ENGINE_VARIABLE, "")
    if asked not in ("", "virtual-machine"):
        _log.warning("%s is '%s'; the only word it knows is virtual-machine.", ENGINE_VARIABLE, asked)
    if asked == "virtual-machine":
        _log.warning("Kernels run on the virtual machine: %s asks for it.", ENGINE_VARIABLE)
        return False
    try:
        object_code.llvm()
    except KernelError as error:
        _log.warning("%s", error)
        return False
    return True
