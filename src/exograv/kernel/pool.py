"""Threads that wait outside Python for chunks of a batch: waking them takes a system call, not the interpreter.

The protocol: `next` hands out numbers of chunks. It is closed, far above any number, while a job is written, and a job
is written only when no worker is inside; so a worker that wakes late finds nothing, or the new job, never half of one.
"""

import ctypes
import os
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

from . import cache as disk
from .object_code import compiler_name, load, object_code, processor

CLOSED = 2**62
"""No batch has as many chunks."""

SPINS = 4096
"""Looks at the workers before this thread offers its core to them."""

NEXT, ACTIVE, N_CHUNKS, CHUNK, END, FUNCTION, ARGUMENTS, SEMAPHORE = 0, 64, 128, 136, 144, 152, 160, 192
"""Places in the pool's memory [bytes]; what is written often has a cache line to itself."""

POOL_BYTES = 320


def _text() -> str:
    def field(name: str, offset: int) -> str:
        return f"  %{name}.a = getelementptr i8, ptr %pool, i64 {offset}"

    job = (("end", END), ("chunk", CHUNK), ("function", FUNCTION), ("arguments", ARGUMENTS), ("n", N_CHUNKS))
    places = "\n".join(field(name, offset) for name, offset in (("next", NEXT), ("active", ACTIVE), *job))
    return f"""
declare i32 @sem_wait(ptr)
declare i32 @sem_post(ptr)
declare i32 @sched_yield()
declare i64 @llvm.smin.i64(i64, i64)

define internal void @chunks(ptr %pool) nounwind {{
entry:
{places}
  br label %take
take:
  %i = atomicrmw add ptr %next.a, i64 1 seq_cst
  %n = load i64, ptr %n.a
  %more = icmp slt i64 %i, %n
  br i1 %more, label %work, label %done
work:
  %chunk = load i64, ptr %chunk.a
  %end = load i64, ptr %end.a
  %function = load ptr, ptr %function.a
  %arguments = load ptr, ptr %arguments.a
  %from = mul i64 %i, %chunk
  %full = add i64 %from, %chunk
  %to = call i64 @llvm.smin.i64(i64 %full, i64 %end)
  call void %function(ptr %arguments, i64 %from, i64 %to)
  br label %take
done:
  ret void
}}

define void @worker(ptr %pool) nounwind {{
entry:
{field("active", ACTIVE)}
{field("semaphore", SEMAPHORE)}
  br label %wait
wait:
  ; an interrupted wait finds no chunk and waits again
  %interrupted = call i32 @sem_wait(ptr %semaphore.a)
  %in = atomicrmw add ptr %active.a, i64 1 seq_cst
  call void @chunks(ptr %pool)
  %out = atomicrmw sub ptr %active.a, i64 1 seq_cst
  br label %wait
}}

define void @dispatch(ptr %pool, ptr %job, i64 %wake) nounwind {{
entry:
{places}
{field("semaphore", SEMAPHORE)}
  %job.n.a = getelementptr i64, ptr %job, i64 0
  %job.chunk.a = getelementptr i64, ptr %job, i64 1
  %job.end.a = getelementptr i64, ptr %job, i64 2
  %job.function.a = getelementptr i64, ptr %job, i64 3
  %job.arguments.a = getelementptr i64, ptr %job, i64 4
  %job.n = load i64, ptr %job.n.a
  %job.chunk = load i64, ptr %job.chunk.a
  %job.end = load i64, ptr %job.end.a
  %job.function = load i64, ptr %job.function.a
  %job.arguments = load i64, ptr %job.arguments.a
  store i64 %job.n, ptr %n.a
  store i64 %job.chunk, ptr %chunk.a
  store i64 %job.end, ptr %end.a
  store i64 %job.function, ptr %function.a
  store i64 %job.arguments, ptr %arguments.a
  store atomic i64 0, ptr %next.a seq_cst, align 8
  br label %waking
waking:
  %woken = phi i64 [ 0, %entry ], [ %woken.next, %wake.one ]
  %more = icmp slt i64 %woken, %wake
  br i1 %more, label %wake.one, label %own
wake.one:
  %posted = call i32 @sem_post(ptr %semaphore.a)
  %woken.next = add i64 %woken, 1
  br label %waking
own:
  call void @chunks(ptr %pool)
  %closed = atomicrmw xchg ptr %next.a, i64 {CLOSED} seq_cst
  br label %look
look:
  %looks = phi i64 [ 0, %own ], [ %looks.next, %again ]
  %active = load atomic i64, ptr %active.a seq_cst, align 8
  %quiet = icmp eq i64 %active, 0
  br i1 %quiet, label %done, label %patience
patience:
  %looks.next = add i64 %looks, 1
  %tired = icmp sgt i64 %looks.next, {SPINS}
  br i1 %tired, label %offer, label %again
offer:
  %yielded = call i32 @sched_yield()
  br label %again
again:
  br label %look
done:
  ret void
}}
"""


class Job(NamedTuple):
    """`function(arguments, from, to)` over 0 … `end`, in chunks."""

    function: int
    arguments: int
    end: int
    chunk: int


class Pool:
    """Threads for batches; one for the whole process and each number of threads, never ended."""

    def __init__(self, threads: int):
        name = disk.key("pool", _text(), processor().name, processor().features, compiler_name())
        code = disk.read(name)
        if code is None:
            code = object_code(_text())
            disk.write(name, code)
        self._code = load(code)
        raw = ctypes.create_string_buffer(POOL_BYTES + 64)
        self._memory, self._raw = -(-ctypes.addressof(raw) // 64) * 64, raw
        ctypes.c_int64.from_address(self._memory + NEXT).value = CLOSED
        _semaphore(self._memory + SEMAPHORE)
        self._wake = threads - 1
        self._lock = threading.Lock()
        self._dispatch = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)(
            self._code.address("dispatch")
        )
        worker = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(self._code.address("worker"))
        for i in range(self._wake):
            threading.Thread(target=worker, args=(self._memory,), name=f"exograv batch {i}", daemon=True).start()

    def run(self, n_chunks: int, job: int) -> None:
        """Do a job, given by its address, on all threads and this one."""
        with self._lock:
            self._dispatch(self._memory, job, min(self._wake, n_chunks - 1))


def runner(threads: int, job: Job, alive: object) -> Callable[[], object]:
    """A call that does a job and keeps `alive` what it works on."""
    n_chunks = -(-job.end // job.chunk)
    memory = (ctypes.c_int64 * 5)(n_chunks, job.chunk, job.end, job.function, job.arguments)
    address = ctypes.addressof(memory)

    def run(_alive: object = (memory, alive)) -> None:
        # Looked up each time: a batch from before a fork must not wait for threads that stayed with the parent.
        _pool(threads).run(n_chunks, address)

    _pool(threads)
    return run


@cache
def threads_can_wait() -> bool:
    """Whether this platform has semaphores in memory; macOS has not, and there batches run on the calling thread."""
    memory = ctypes.create_string_buffer(64)
    try:
        _semaphore(ctypes.addressof(memory))
    except (OSError, AttributeError, TypeError):
        return False
    return True


def _semaphore(address: int) -> None:
    if ctypes.CDLL(None).sem_init(ctypes.c_void_p(address), 0, 0) != 0:
        raise OSError("sem_init failed")


@dataclass
class _Process:
    """This process's pools, by their threads; kept for ever, for their threads never end."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    pools: dict[int, Pool] = field(default_factory=dict)


_process = _Process()
_parents: list[_Process] = []


def _pool(threads: int) -> Pool:
    found = _process.pools.get(threads)
    if found is None:
        with _process.lock:
            found = _process.pools.get(threads) or Pool(threads)
            _process.pools[threads] = found
    return found


def _forget_the_parents_threads() -> None:
    global _process  # noqa: PLW0603 - a forked process begins anew; its lock may be held by a thread that is not here
    _parents.append(_process)
    _process = _Process()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_the_parents_threads)
