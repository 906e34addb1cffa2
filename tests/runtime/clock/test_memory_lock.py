"""A real-time process holds what it uses in RAM, and what its libraries only reserve as soon as it is touched."""

import subprocess
import sys
from pathlib import Path

import pytest

from exograv.runtime.clock.memory_lock import RESERVE_BYTES, MemoryRange, memory_ranges

SMAPS = """\
7f00c0000000-7f00c4000000 rw-p 00000000 00:00 0
Size:              65536 kB
Rss:                 736 kB
7f0100000000-7f0101000000 r-xp 00001000 fe:00 77                 /lib/with spaces/libguard.so
Size:              16384 kB
Rss:                2048 kB
"""

LOCKED = """
import mmap, os
from exograv.runtime.clock.memory_lock import RESERVE_BYTES
from exograv.runtime.clock.realtime import realtime

def resident_kB(memory):
    here = address(memory)
    for line in open("/proc/self/smaps"):
        head = line.split()[0]
        if "-" in head and ":" not in head:
            start, end = (int(number, 16) for number in head.split("-"))
        elif line.startswith("Rss:") and start <= here < end:
            return int(line.split()[1])

def address(memory):
    import ctypes
    return ctypes.addressof(ctypes.c_char.from_buffer(memory))

# With equal rights the system would join the two.
rights = mmap.PROT_READ | mmap.PROT_WRITE
reserve = mmap.mmap(-1, 4 * RESERVE_BYTES, mmap.MAP_PRIVATE, rights | mmap.PROT_EXEC)
used = mmap.mmap(-1, RESERVE_BYTES // 2, mmap.MAP_PRIVATE, rights)
reserve[0] = used[0] = 1
with realtime(min(os.sched_getaffinity(0))) as rights:
    print(rights.is_locked, resident_kB(reserve), resident_kB(used))
    reserve[RESERVE_BYTES : RESERVE_BYTES + 4096] = bytes(4096)
    print(resident_kB(reserve))
"""


def test_a_process_reads_its_own_mappings(tmp_path: Path):
    (tmp_path / "smaps").write_text(SMAPS)
    first, second = memory_ranges(tmp_path / "smaps")
    assert first == MemoryRange(0x7F00C0000000, 64 << 20, "rw-p", "", 736 << 10)
    assert (second.path, second.length) == ("/lib/with spaces/libguard.so", 16 << 20)


@pytest.mark.parametrize(
    ("path", "length", "resident", "is_reserve"),
    [
        ("", 2 * RESERVE_BYTES, 0, True),
        ("", 2 * RESERVE_BYTES, 2 * RESERVE_BYTES, False),
        ("", RESERVE_BYTES // 2, 0, False),
        ("/dev/shm/psm_1", 2 * RESERVE_BYTES, 0, True),
        ("/lib/libmujoco.so", 2 * RESERVE_BYTES, 0, False),
        ("/lib/llvmlite/binding/libllvmlite.so", 2 * RESERVE_BYTES, 0, True),
    ],
)
def test_only_large_memory_without_a_file_and_the_compiler_are_reserves(
    path: str, length: int, resident: int, is_reserve: bool
):
    assert MemoryRange(4096, length, "rw-p", path, resident).is_reserve is is_reserve


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux only")
def test_memory_in_use_is_resident_and_a_reserve_is_when_it_is_touched():
    told = subprocess.run([sys.executable, "-c", LOCKED], capture_output=True, text=True, check=True).stdout
    first, second = told.splitlines()
    is_locked, reserve_kB, used_kB = first.split()
    if is_locked != "True":
        pytest.skip("This system refuses locked memory.")
    assert int(reserve_kB) < RESERVE_BYTES >> 10
    assert int(used_kB) == RESERVE_BYTES >> 11
    assert int(second) > int(reserve_kB)
