"""Compilation of LLVM IR to code in memory, by the LLVM in llvmlite, for this processor."""

import ctypes
from dataclasses import dataclass
from functools import cache
from typing import Any

from exograv.errors import KernelError

from .operations import LIBRARY, LIBRARY_OF_TWO


@dataclass(frozen=True)
class Processor:
    """Processor that the code is made for, and the only kind that it may run on."""

    name: str
    features: str

    @property
    def lanes(self) -> int:
        """Doubles in the widest vector of this processor."""
        switched_on = self.features.split(",")
        return 8 if "+avx512f" in switched_on else 4 if "+avx" in switched_on else 2


@cache
def llvm() -> Any:
    """Return the LLVM binding, initialised.

    Raises:
        KernelError: llvmlite is not installed, or does not support this platform.
    """
    try:
        import llvmlite.binding as binding

        binding.initialize_native_target()
        binding.initialize_native_asmprinter()
        binding.check_jit_execution()
        _add_symbols(binding)
        # Called here so that a computer that cannot report its features gets the error below.
        binding.get_host_cpu_features()
    except (ImportError, OSError, RuntimeError, TypeError, AttributeError) as error:
        raise KernelError(
            f"No native code on this computer: {error}. The virtual machine runs the same programs, slower; "
            "pip install llvmlite where there is a wheel for it."
        ) from error
    return binding


@cache
def processor() -> Processor:
    """Return this computer's processor."""
    binding = llvm()
    return Processor(binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())


def compiler_name() -> str:
    """Versions of the compiler that determine the code."""
    import llvmlite

    return f"llvmlite {llvmlite.__version__} LLVM {llvm().llvm_version_info}"


def object_code(text: str) -> bytes:
    """Compile a module's text to object code.

    LLVM's own optimiser does not run: CasADi has already removed all redundancy from the program.
    """
    binding = llvm()
    module = binding.parse_assembly(text)
    here = processor()
    machine = binding.Target.from_default_triple().create_target_machine(
        cpu=here.name, features=here.features, opt=2, reloc="pic", jit=True
    )
    return machine.emit_object(module)


@dataclass(frozen=True)
class Loaded:
    """Code in memory; it is unloaded with this object."""

    _engine: Any

    def address(self, name: str) -> int:
        """Address of a function."""
        return self._engine.get_function_address(name)


def load(code: bytes) -> Loaded:
    """Load object code into memory and link it to the C library and to Python."""
    binding = llvm()
    machine = binding.Target.from_default_triple().create_target_machine(jit=True)
    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine)
    engine.add_object_file(binding.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return Loaded(engine)


def _add_symbols(binding: Any) -> None:
    """Register outside functions by address, because an executable need not export them to LLVM's search."""
    process = ctypes.CDLL(None)
    for name in ("PyCapsule_GetPointer", "Py_IncRef"):
        binding.add_symbol(name, _address(getattr(ctypes.pythonapi, name)))
    for name in {*LIBRARY.values(), *LIBRARY_OF_TWO.values(), "fma", "memcpy", "sem_wait", "sem_post", "sched_yield"}:
        if hasattr(process, name):
            binding.add_symbol(name, _address(getattr(process, name)))


def _address(function: Any) -> int:
    return ctypes.cast(function, ctypes.c_void_p).value or 0
