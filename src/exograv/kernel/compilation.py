"""Choice of the engine: native code where it can be made, CasADi's virtual machine elsewhere."""

import logging
import os
from collections.abc import Iterable, Mapping
from functools import cache
from typing import overload

import numpy as np

from exograv.errors import KernelError

from . import native, object_code, virtual_machine
from .batch import Batch, compile_batch
from .interface import Kernel
from .recipe import AnyFunction

ENGINE_VARIABLE = "EXOGRAV_KERNEL"
"""Environment variable; `virtual-machine` disables native code, to compare both engines or to rule out a fault."""

_log = logging.getLogger(__name__)


@overload
def compile(
    function: AnyFunction, bindings: Mapping[str, np.ndarray] | None = None, *, carry: Mapping[str, str] | None = None
) -> Kernel: ...


@overload
def compile(
    function: AnyFunction, *, lanes: int, shared: Iterable[str] = (), dtype: type | str = np.float64
) -> Batch: ...


def compile(
    function: AnyFunction,
    bindings: Mapping[str, np.ndarray] | None = None,
    *,
    carry: Mapping[str, str] | None = None,
    lanes: int | None = None,
    shared: Iterable[str] = (),
    dtype: type | str = np.float64,
) -> Kernel | Batch:
    """Bind a function's arguments and results to memory, or with `lanes` make it ready for batches.

    Args:
        function: Any CasADi function that is one sequence of scalar operations.
        bindings: Buffers of the caller for some arguments or results by name, in place of new ones: float64,
            of the right size, contiguous. Elements are read in CasADi's order, column by column. A C-ordered array of
            the transposed shape has that order.
        carry: Arguments that a result or another argument overwrites after each call, for the next call. The copies
            are made one after another in the order given.
        lanes: States that one instruction works on: 2, 4, 8, 16 or 32, or 0 for the widest of this processor.
        shared: Arguments of a batch that are the same for every state.
        dtype: Element type of a batch, float64 or float32.

    Raises:
        KernelError: The function has an unknown operation, which the message names.
        ValueError: A name is unknown, or a buffer does not fit.
    """
    if lanes is None and (shared or np.dtype(dtype) != np.float64):
        raise ValueError(f"{function.name()}: shared and dtype are for batches; give lanes too, 0 for the widest.")
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
    """Return True if this computer can make native code; the reason against it is logged once."""
    asked = os.environ.get(ENGINE_VARIABLE, "")
    if asked not in ("", "virtual-machine"):
        _log.warning("%s is '%s'; the only allowed value is virtual-machine.", ENGINE_VARIABLE, asked)
    if asked == "virtual-machine":
        _log.warning("Kernels run on the virtual machine: %s asks for it.", ENGINE_VARIABLE)
        return False
    try:
        object_code.llvm()
    except KernelError as error:
        _log.warning("%s", error)
        return False
    return True
