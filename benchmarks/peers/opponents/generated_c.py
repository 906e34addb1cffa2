"""CasADi's generated C, compiled for this processor by the C compiler of this computer."""

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path

import casadi as ca

from exograv.kernel.memory import flat
from exograv.kernel.program import straight_line
from peers.tasks.interface import BatchShape, Call, Missing, Task, copy_into
from peers.tasks.memory import StateAfterState, single_memory

FLAGS = ("-O3", "-march=native", "-shared", "-fPIC", "-fno-semantic-interposition")
"""The last flag lets the compiler inline CasADi's own small functions, such as `casadi_fmax`, in a shared library."""


class GeneratedC:
    """Single states through CasADi's buffers, batches by a loop in C."""

    name = "CasADi generated C"

    def __init__(self):
        self._libraries: dict[tuple[str, str], ctypes.CDLL] = {}

    def version(self) -> str:
        """Return the versions of CasADi and of the compiler."""
        return f"{version('casadi')}, {compiler_version()} {' '.join(FLAGS[:2])}"

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call on fixed memory."""
        function = straight_line(task.function).function
        if batch is not None:
            return _batch_call(self._library(task, function, batch), task, function, batch)
        with tempfile.TemporaryDirectory() as folder:  # a loaded library stays mapped after the folder is gone
            return single_call(function, shared_library(function, Path(folder)))

    def _library(self, task: Task, function: ca.Function, batch: BatchShape) -> ctypes.CDLL:
        """Compile the batch loop; one compilation serves all sizes."""
        key = (task.name, batch.dtype)
        if key not in self._libraries:
            element = "double" if batch.dtype == "float64" else "float"
            loop = _loop(function, element, task.shared)
            with tempfile.TemporaryDirectory() as folder:
                path = shared_library(function, Path(folder), element, loop)
                self._libraries[key] = ctypes.CDLL(str(path))
        return self._libraries[key]


def single_call(function: ca.Function, library: Path) -> Call:
    """Return the function of a compiled library, on fixed memory."""
    external = ca.external(function.name(), str(library))
    inputs = {function.name_in(i): single_memory(function.size_in(i)) for i in range(function.n_in())}
    outputs = {function.name_out(i): single_memory(function.size_out(i)) for i in range(function.n_out())}
    buffer, run = external.buffer()
    for i, array in enumerate(inputs.values()):
        buffer.set_arg(i, flat(array))  # pyright: ignore[reportCallIssue] - CasADi's stub knows raw pointers only
    for i, array in enumerate(outputs.values()):
        buffer.set_res(i, flat(array))  # pyright: ignore[reportCallIssue] - as above
    return Call(partial(copy_into, inputs), run, lambda: outputs, (external, buffer), library.stat().st_size)


def _batch_call(library: ctypes.CDLL, task: Task, function: ca.Function, batch: BatchShape) -> Call:
    memory = StateAfterState(task, function, batch)
    pointers = [
        (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays.values()))
        for arrays in (memory.inputs, memory.outputs)
    ]
    run = partial(library.exograv_batch, *pointers, ctypes.c_longlong(batch.size))
    return Call(memory.load, run, lambda: memory.results, (library, memory))


def _loop(function: ca.Function, element: str, shared: tuple[str, ...]) -> str:
    counts = [0 if function.name_in(i) in shared else function.numel_in(i) for i in range(function.n_in())]
    in_steps = ", ".join(map(str, counts))
    out_steps = ", ".join(str(function.numel_out(i)) for i in range(function.n_out()))
    n_in, n_out = function.n_in(), function.n_out()
    return f"""
void exograv_batch(const {element} **in, {element} **out, long long count) {{
  static const long long in_step[] = {{{in_steps}}}, out_step[] = {{{out_steps}}};
    const {element} *arg[{function.sz_arg() + n_in}];
    {element} *res[{function.sz_res() + n_out}], w[{function.sz_w() + 1}];
    long long iw[{function.sz_iw() + 1}];
    for (long long k = 0; k < count; ++k) {{
      for (int i = 0; i < {n_in}; ++i) arg[i] = in[i] + k * in_step[i];
      for (int i = 0; i < {n_out}; ++i) res[i] = out[i] + k * out_step[i];
      {function.name()}(arg, res, iw, w, 0);
    }}
}}
"""


def shared_library(function: ca.Function, folder: Path, element: str = "double", more: str = "", *flags: str) -> Path:
    """Compile the function's C, with `more` code added.

    Raises:
        Missing: There is no compiler, or the compiler rejected the code.
    """
    program = compiler()
    generator = ca.CodeGenerator("generated.c", {"casadi_real": element})
    generator.add(function)
    source, library = folder / "generated.c", folder / "generated.so"
    source.write_text(generator.dump() + more)
    command = [program, *FLAGS, *flags, "-o", str(library), str(source), "-lm"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise Missing(f"{program} rejected the code: {result.stderr.strip().splitlines()[-1]}")
    return library


def compiler() -> str:
    """Return the name of the C compiler.

    Raises:
        Missing: There is none.
    """
    for name in ("gcc", "clang", "cc"):
        if shutil.which(name):
            return name
    raise Missing("no C compiler (gcc, clang or cc) on this computer")


@cache
def compiler_version() -> str:
    """Return the first line that the compiler says of its version."""
    shown = subprocess.run([compiler(), "--version"], capture_output=True, text=True, check=False).stdout
    return shown.splitlines()[0]
