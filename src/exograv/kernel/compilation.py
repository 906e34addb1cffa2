"""Which engine runs a function: native code where it can be made, CasADi's virtual machine elsewhere."""

import logging
import os
from collections.abc import Mapping
from functools import cache

import casadi as ca
import numpy as np

from exograv.errors import KernelError

from . import native, object_code, virtual_machine
from .interface import Kernel

ENGINE_VARIABLE = "EXOGRAV_KERNEL"
"""Set to `virtual-machine` it keeps native code away, to compare the two or to leave a suspicion behind."""

_log = logging.getLogger(__name__)


def compile(
    function: ca.Function, bindings: Mapping[str, np.ndarray] | None = None, *, carry: Mapping[str, str] | None = None
) -> Kernel:
    """Bind a function's arguments and results to memory.

    Args:
        function: Any CasADi function that is one line of scalar operations.
        bindings: Memory of the caller for some arguments or results by name, in place of new buffers: float64,
            of the right size, contiguous; its elements are taken in CasADi's order, column by column. A C-ordered
            array of the transposed shape has that order.
        carry: Arguments that are overwritten after each call, for the next one, by a result or another argument.

    Raises:
        KernelError: An operation is not known; it is named.
        ValueError: A binding or a carried name is not known, or its memory does not fit.
    """
    engine = native if native_is_possible() else virtual_machine
    return engine.compile(function, bindings, carry)


@cache
def native_is_possible() -> bool:
    """Whether this computer can make native code; if not it is said once."""
    if os.environ.get(ENGINE_VARIABLE) == "virtual-machine":
        _log.warning("Kernels run on the virtual machine: %s asks for it.", ENGINE_VARIABLE)
        return False
    try:
        object_code.llvm()
    except KernelError as error:
        _log.warning("%s", error)
        return False
    return True
