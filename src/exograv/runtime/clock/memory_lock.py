"""Lock of a process's memory in RAM: all that is in use at once, and large reserves page by page as they are touched.

Libraries reserve far more than they use: OpenBLAS 32 MB of work space, MuJoCo 14 MB per simulation, the compiler of the
kernels 150 MB of code. Guard and control were two to three times as large when all of it was locked. A page of a
reserve that the loop touches later comes from free memory, not from a disk.
"""

import ctypes
import errno
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4  # <sys/mman.h>; the same on x86 and Arm

RESERVE_BYTES = 16 << 20
"""Size from which a mapping without a file, less than half in use, is a reserve; stacks and heaps are smaller."""

COMPILER = "llvmlite"
"""Part of the path of the compiler's library. Kernels are compiled before a loop begins, never in it."""

SHARED = "/dev/shm/"
"""Folder of shared memory, which has no disk behind it."""

HEAD = re.compile(r"^([0-9a-f]+)-([0-9a-f]+) (\S+) \S+ \S+ \S+\s*(.*)$")


@dataclass(frozen=True)
class MemoryRange:
    """Mapping of this process."""

    start: int
    length: int
    """Size [bytes]."""
    rights: str
    """Rights as in `/proc/self/smaps`, such as `r-xp`."""
    path: str
    """Path of its file; empty for memory without a file."""
    resident: int
    """Part in RAM [bytes]."""

    @property
    def is_reserve(self) -> bool:
        """True for memory of which a loop touches little or nothing more than before."""
        if COMPILER in self.path or self.path == "[heap]":
            return True
        has_file = self.path.startswith("/") and not self.path.startswith(SHARED)
        return not has_file and self.length >= RESERVE_BYTES and 2 * self.resident < self.length


def lock_memory(libc: Callable[[str], Callable[..., None]]) -> None:
    """Lock the memory of this process.

    Args:
        libc: Function that returns a function of the C library, which raises an OSError on failure.

    Raises:
        OSError: The system refuses it.
    """
    try:
        libc("mlockall")(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT)
    except OSError as error:
        if error.errno != errno.EINVAL:  # Linux before 4.4 locks all or nothing
            raise
        libc("mlockall")(MCL_CURRENT | MCL_FUTURE)
        return
    lock = libc("mlock")
    for one in list(memory_ranges()):
        if not one.is_reserve and not one.rights.startswith("---"):
            try:
                lock(ctypes.c_void_p(one.start), ctypes.c_size_t(one.length))
            except OSError as error:
                if error.errno != errno.ENOMEM:  # another thread has returned the memory, or the kernel maps no RAM
                    raise


def memory_ranges(smaps: Path = Path("/proc/self/smaps")) -> Iterator[MemoryRange]:
    """Yield the mappings of this process."""
    head: re.Match[str] | None = None
    for line in smaps.read_text(encoding="utf-8", errors="replace").splitlines():
        if found := HEAD.match(line):
            head = found
        elif head is not None and line.startswith("Rss:"):
            start, end = int(head[1], 16), int(head[2], 16)
            yield MemoryRange(start, end - start, head[3], head[4], 1024 * int(line.split()[1]))


def c_function(name: str) -> Callable[..., None]:
    """Return a function of the C library that raises an OSError on failure."""
    function = getattr(ctypes.CDLL(None, use_errno=True), name)

    def call(*arguments: object) -> None:
        if function(*arguments) != 0:
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number))

    return call
