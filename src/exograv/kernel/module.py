"""LLVM module of a program: its pieces, and the function that runs them for one state or for a batch."""

from .emission import Emission, MemoryLayout
from .program import Program
from .trigonometry import reduction, sincos

# Without the last two attributes, LLVM splits vectors of 512 bits on processors that it takes to be faster with 256.
# With stack probing, an overflow ends at the guard page and not in another thread's memory.
ATTRIBUTES = '"probe-stack"="inline-asm" "min-legal-vector-width"="512" "prefer-vector-width"="512"'


def module_text(program: Program, layout: MemoryLayout) -> str:
    """IR of `run`, and for a single state also of `call`, which Python calls without a wrapper.

    Raises:
        KernelError: The program has an unknown operation.
    """
    emission = Emission(program, layout)
    pieces = list(emission.pieces())
    parts = [f"attributes #0 = {{ nounwind noinline {ATTRIBUTES} }}", "!0 = !{}"]
    declared = set(emission.declarations)
    if emission.has_trigonometry:
        parts += [reduction(), sincos(layout.lanes)]
        declared |= _trigonometry_declarations(layout.lanes)
    calls = "\n".join(f"  call void @piece.{i}(ptr %args, ptr %work, i64 %at, i64 %row)" for i in range(len(pieces)))
    n_memories = len(program.arguments) + len(program.results) + 1  # the constants
    run = _run_single(emission, layout, calls) + _call(n_memories) if layout.lanes == 1 else _run_batch(
        emission, layout, calls, n_memories
    )  # fmt: skip
    return "\n".join([*parts, *sorted(declared), *pieces, run])


def _run_single(emission: Emission, layout: MemoryLayout, calls: str) -> str:
    """IR of `run(args)`; args points at all memories: arguments, results, constants."""
    copies = []
    for source, target, count in layout.carried:
        for name, memory in (("s", source), ("t", target)):
            copies.append(f"  %{name}{target}.a = getelementptr ptr, ptr %args, i64 {memory}")
            copies.append(f"  %{name}{target} = load ptr, ptr %{name}{target}.a")
        copies.append(f"  call void @llvm.memcpy.p0.p0.i64(ptr %t{target}, ptr %s{target}, i64 {8 * count}, i1 false)")

    calls = calls.replace("%at", "0").replace("%row", "0")
    body = "\n".join([f"  {emission.work}", calls, *copies])
    return f"""declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
define void @run(ptr %args) #0 {{
{body}
  ret void
}}
"""


def _call(n_memories: int) -> str:
    """IR of `call(self, nothing)`, a Python function without arguments; `self` is a capsule around args.

    The last pointer of args is None. Python expects it as the returned value, with one more reference.
    """
    return f"""declare ptr @PyCapsule_GetPointer(ptr, ptr)
declare void @Py_IncRef(ptr)
define ptr @call(ptr %self, ptr %nothing) #0 {{
  %args = call ptr @PyCapsule_GetPointer(ptr %self, ptr null)
  call void @run(ptr %args)
  %none.a = getelementptr ptr, ptr %args, i64 {n_memories}
  %none = load ptr, ptr %none.a
  call void @Py_IncRef(ptr %none)
  ret ptr %none
}}
"""


def _run_batch(emission: Emission, layout: MemoryLayout, calls: str, n_memories: int) -> str:
    """IR of `run(args, begin, end)`, a loop over states in steps of the lanes; the last of args is a row's length."""
    return f"""define void @run(ptr %args, i64 %begin, i64 %end) #0 {{
entry:
  {emission.work}
  %row.a = getelementptr ptr, ptr %args, i64 {n_memories}
  %row = load i64, ptr %row.a
  br label %loop
loop:
  %at = phi i64 [ %begin, %entry ], [ %next, %body ]
  %more = icmp slt i64 %at, %end
  br i1 %more, label %body, label %done
body:
{calls}
  %next = add i64 %at, {layout.lanes}
  br label %loop
done:
  ret void
}}
"""


def _trigonometry_declarations(lanes: int) -> set[str]:
    if lanes == 1:
        return {"declare double @llvm.fabs.f64(double)"}
    wide = f"<{lanes} x double>"
    return {
        f"declare {wide} @llvm.fabs.v{lanes}f64({wide})",
        f"declare i1 @llvm.vector.reduce.or.v{lanes}i1(<{lanes} x i1>)",
    }
