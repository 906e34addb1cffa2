"""CasADi's generated C as the body of a loop over states that the C compiler vectorises."""

import ctypes
import re
import subprocess
import tempfile
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np

from exograv.kernel.program import straight_line
from peers.tasks.interface import BatchShape, Call, Missing, Task, copy_into

from .generated_c import FLAGS, compiler, compiler_version

MORE_FLAGS = ("-mprefer-vector-width=512", "-ffast-math", "-fopenmp-simd")

VECTOR_FUNCTIONS = {"sin": 1, "cos": 1, "tanh": 1, "exp": 1, "pow": 2, "atan2": 2}
"""Functions of libmvec (glibc from 2.35 on) with their numbers of arguments; errors up to four units of the last place.

They get names of their own: gcc would merge sine and cosine of an angle into one call that has no vector form.
"""

BODY = re.compile(r"static int casadi_f0\(.*?\)\s*\{(.*?)return 0;\s*\}", re.DOTALL)
READ = re.compile(r"arg\[(\d+)\]\? ?arg\[\1\]\[(\d+)\] : 0")
WRITE = re.compile(r"if \(res\[(\d+)\]!=0\) res\[\1\]\[(\d+)\]=")


class GeneratedCLanes:
    """Batches whose states lie side by side, as ours do; one vector of states at a time."""

    name = "CasADi generated C, vectorised"

    def __init__(self):
        self._libraries: dict[tuple[str, str], ctypes.CDLL] = {}

    def version(self) -> str:
        """Return the versions of CasADi and of the compiler."""
        return f"{ca.CasadiMeta.version()}, {compiler_version()} {' '.join((*FLAGS[:2], *MORE_FLAGS))}"

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call on fixed memory."""
        if batch is None:
            raise Missing("computes many states a call; see CasADi generated C")
        function, key = straight_line(task.function).function, (task.name, batch.dtype)
        if key not in self._libraries:
            self._libraries[key] = _library(function, task.shared, "double" if batch.dtype == "float64" else "float")
        return _call(self._libraries[key], task, function, batch)


def _call(library: ctypes.CDLL, task: Task, function: ca.Function, batch: BatchShape) -> Call:
    def memory(size: tuple[int, int], count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the memory (entry, state), entries column by column, and a view as the states have it."""
        rows, columns = size
        flat = np.zeros((rows * columns, count), batch.dtype)
        view = flat.reshape(columns, rows, count).transpose(1, 0, 2)
        return flat, view[:, 0] if columns == 1 else view

    names = [function.name_in(i) for i in range(function.n_in())]
    inputs = [memory(function.size_in(i), 1 if n in task.shared else batch.size) for i, n in enumerate(names)]
    outputs = [memory(function.size_out(i), batch.size) for i in range(function.n_out())]
    views = {name: view[..., 0] if name in task.shared else view for name, (_, view) in zip(names, inputs, strict=True)}
    results = {function.name_out(i): view for i, (_, view) in enumerate(outputs)}
    pointers = [(ctypes.c_void_p * len(s))(*(flat.ctypes.data for flat, _ in s)) for s in (inputs, outputs)]
    run = partial(library.exograv_lanes, *pointers, ctypes.c_longlong(batch.size))
    return Call(partial(copy_into, views), run, lambda: results, (library, inputs, outputs))


def source(function: ca.Function, shared: tuple[str, ...], element: str) -> str:
    """Return C with the function's statements in a loop over states.

    Raises:
        Missing: CasADi's code has another form than expected.
    """
    generator = ca.CodeGenerator("generated.c", {"casadi_real": element})
    generator.add(function)
    text = generator.dump()
    found = BODY.search(text)
    if found is None:
        raise Missing("CasADi generated code of an unknown form")
    many = [function.name_in(i) not in shared for i in range(function.n_in())]

    def read(one: re.Match[str]) -> str:
        i, entry = int(one[1]), int(one[2])
        return f"in{i}[{entry} * count + k]" if many[i] else f"in{i}[{entry}]"

    body = WRITE.sub(lambda one: f"out{one[1]}[{one[2]} * count + k]=", READ.sub(read, found[1]))
    if "arg[" in body or "res[" in body:
        raise Missing("CasADi generated an access of an unknown form")
    names = "|".join(VECTOR_FUNCTIONS)
    body = re.sub(rf"\b({names})\(", r"lanes_\1(", body)
    pointers = [f"const {element} *restrict in{i} = in[{i}];" for i in range(function.n_in())]
    pointers += [f"{element} *restrict out{i} = out[{i}];" for i in range(function.n_out())]
    lines = "\n  ".join(pointers)
    letter = "f" if element == "float" else ""
    declared = "".join(
        f"#pragma omp declare simd notinbranch\n"
        f'{element} lanes_{name}({", ".join([element] * count)}) __asm__("{name}{letter}");\n'
        for name, count in VECTOR_FUNCTIONS.items()
    )
    loop = f"""
{declared}
void exograv_lanes(const {element} **in, {element} **out, long long count) {{
  {lines}
  #pragma omp simd
  for (long long k = 0; k < count; ++k) {{
{body}
  }}
}}
"""
    return text + loop


def _library(function: ca.Function, shared: tuple[str, ...], element: str) -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:  # a loaded library stays mapped after the folder is gone
        text, code, library = (Path(folder) / f"lanes.{ending}" for ending in ("c", "o", "so"))
        text.write_text(source(function, shared, element))
        # Linked with -ffast-math, gcc adds code that flushes subnormal numbers to zero in the whole process.
        flags = [flag for flag in FLAGS if flag != "-shared"]
        _run([compiler(), *flags, *MORE_FLAGS, "-c", "-o", str(code), str(text)])
        _run([compiler(), *FLAGS, "-o", str(library), str(code), "-lmvec", "-lm"])
        return ctypes.CDLL(str(library))


def _run(command: list[str]) -> None:
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise Missing(f"{command[0]} rejected the code: {result.stderr.strip().splitlines()[-1]}")
