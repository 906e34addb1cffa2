"""Properties of the computer that decide whether a loop can be punctual on it."""

import os
import platform
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple


@dataclass(frozen=True)
class Host:
    """Facts that the operating system states about itself, without measurement."""

    kernel: str
    """Name and build of the kernel."""

    is_virtual: bool
    """True if a hypervisor lies below the kernel; the hypervisor may stop the kernel without its knowledge."""

    is_realtime_kernel: bool
    """True if the kernel is built with PREEMPT_RT."""

    isolated_cpus: tuple[int, ...]
    """Processors kept free of other work (`isolcpus`)."""

    cpus: tuple[int, ...]
    """Processors that this process may use."""

    governors: tuple[str, ...]
    """Policies that set the frequency of the processors; empty if the system has none."""

    clock_source: str
    """Clock that the kernel reads; empty if the system does not state it."""


def read_host(root: Path = Path("/")) -> Host:
    """Read the properties from the system's own files under `root`."""
    build = platform.version()
    cpus = root / "sys/devices/system/cpu"
    governors = {_text(path) for path in cpus.glob("cpu[0-9]*/cpufreq/scaling_governor")}
    return Host(
        kernel=f"{platform.system()} {platform.release()}",
        is_virtual=_has_hypervisor(root),
        # The file comes with the PREEMPT_RT patch. Kernels with RT built in have it in their build name too.
        is_realtime_kernel=_text(root / "sys/kernel/realtime") == "1" or "PREEMPT_RT" in build,
        isolated_cpus=cpu_list(_text(cpus / "isolated")),
        cpus=_cpus(),
        governors=tuple(sorted(governors - {""})),
        clock_source=_text(root / "sys/devices/system/clocksource/clocksource0/current_clocksource"),
    )


class LoopCpus(NamedTuple):
    """Processors of the live loop: two different ones, if this process may use two."""

    guard: int
    control: int


def loop_cpus(host: Host | None = None) -> LoopCpus:
    """Return the processors of guard and control.

    Isolated processors come first, then the last ones: the first one usually serves the interrupts.

    Args:
        host: Computer; this one if absent.
    """
    host = read_host() if host is None else host
    others = sorted(set(host.cpus) - set(host.isolated_cpus), reverse=True)
    guard, *further = (*host.isolated_cpus, *others)
    return LoopCpus(guard, further[0] if further else guard)


def cpu_list(text: str) -> tuple[int, ...]:
    """Return the numbers of a list in the kernel's own form, such as "1,4-6"."""
    found: list[int] = []
    for part in filter(None, text.split(",")):
        first, _, last = part.partition("-")
        found.extend(range(int(first), int(last or first) + 1))
    return tuple(found)


def _cpus() -> tuple[int, ...]:
    if sys.platform.startswith("linux"):
        return tuple(sorted(os.sched_getaffinity(0)))
    return tuple(range(os.cpu_count() or 1))


def _has_hypervisor(root: Path) -> bool:
    """Return True if a hypervisor is found.

    On x86 the processor has a flag for it. Other processors show only what hypervisors announce, so silence proves
    nothing.
    """
    flags = [line for line in _text(root / "proc/cpuinfo").splitlines() if line.startswith("flags")]
    announced = (root / "sys/hypervisor/type", root / "proc/device-tree/hypervisor")
    return any("hypervisor" in line.split() for line in flags) or any(path.exists() for path in announced)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
