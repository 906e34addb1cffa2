"""Kernels in machine code of this processor; a call from Python costs as much as a call of a built-in function."""

import ctypes
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from . import cache
from .emission import MemoryLayout
from .interface import Kernel, NativeCall
from .memory import bound_memory, carried_memory
from .module import module_text
from .object_code import Loaded, compiler_name, load, object_code, processor
from .program import Program, straight_line
from .recipe import AnyFunction


def compile(
    function: AnyFunction, bindings: Mapping[str, np.ndarray] | None = None, carry: Mapping[str, str] | None = None
) -> Kernel:
    """Compile a function as `kernel.compile` does, to native code only.

    Raises:
        KernelError: This computer makes no native code, or an operation is unknown.
        ValueError: A name is unknown, or a buffer does not fit.
    """
    program = straight_line(function)
    made = machine_code(program, MemoryLayout(carried=carried_memory(program, carry)))
    return _bound(program.outlined(), made, bindings)


def _bound(program: Program, made: "MachineCode", bindings: Mapping[str, np.ndarray] | None = None) -> Kernel:
    inputs, outputs = bound_memory(program, bindings)
    memories = (*inputs.values(), *outputs.values(), program.constants.copy())
    pointers = (ctypes.c_void_p * (len(memories) + 1))(*(memory.ctypes.data for memory in memories), id(None))
    return Kernel(
        name=program.name,
        engine="native",
        inputs=inputs,
        outputs=outputs,
        n_instructions=program.n_instructions,
        code_bytes=made.n_bytes,
        build_s=made.build_s,
        from_cache=made.from_cache,
        evaluate=_python_function(made.loaded, memories, pointers),
        again=lambda: _bound(program, made),
        native=NativeCall(made.loaded.address("run"), ctypes.addressof(pointers)),
    )


_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class MachineCode:
    """Loaded program, with the figures of its compilation."""

    loaded: Loaded
    n_bytes: int
    build_s: float
    from_cache: bool


def machine_code(program: Program, layout: MemoryLayout) -> MachineCode:
    """Compile a program, or read it from the cache.

    Raises:
        KernelError: This computer makes no native code, or an operation is unknown.
    """
    start, here = time.perf_counter(), processor()
    name = cache.key(program.fingerprint, repr(layout), here.name, here.features, compiler_name())
    code = cache.read(name)
    from_cache = code is not None
    if code is None:
        code = object_code(module_text(program, layout))
        cache.write(name, code)
    program.keep()
    made = MachineCode(load(code), len(code), time.perf_counter() - start, from_cache)
    _log.info(
        "%s: %d instructions, %d bytes of code, %s in %.2f s.",
        program.name,
        program.n_instructions,
        made.n_bytes,
        "found" if from_cache else "compiled",
        made.build_s,
    )
    return made


class _MethodDefinition(ctypes.Structure):
    """Structure PyMethodDef of Python's C interface."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("function", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("documentation", ctypes.c_char_p),
    )


@dataclass(frozen=True, eq=False)
class _Alive:
    """Container of references that a compiled function keeps alive.

    It takes the place of the function's module, which `inspect` expects to be hashable.
    """

    parts: tuple[object, ...]


METH_NOARGS = 0x0004
"""Flag of Python's C interface for a function that takes only self."""


def _python_function(
    code: Loaded, memories: tuple[np.ndarray, ...], pointers: "ctypes.Array[ctypes.c_void_p]"
) -> Callable[[], object]:
    """Return the module's `call` as a built-in function; its self is a capsule around the addresses of all memories.

    A call through ctypes would take 0.1 µs longer. That is a third of the time of the dynamics of seven joints.
    """
    python = ctypes.pythonapi
    python.PyCapsule_New.restype = ctypes.py_object
    python.PyCapsule_New.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
    python.PyCFunction_NewEx.restype = ctypes.py_object
    python.PyCFunction_NewEx.argtypes = [ctypes.c_void_p, ctypes.py_object, ctypes.py_object]
    capsule = python.PyCapsule_New(ctypes.addressof(pointers), None, None)
    definition = _MethodDefinition(b"evaluate", code.address("call"), METH_NOARGS, None)
    # The function holds its third argument, meant for the name of its module, as long as it lives. So all of these
    # references live as long as the function.
    alive = _Alive((code, memories, pointers, definition))
    return python.PyCFunction_NewEx(ctypes.addressof(definition), capsule, alive)
