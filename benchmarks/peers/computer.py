"""Description of the computer of a run, to interpret its figures elsewhere."""

import os
import platform
import re
from pathlib import Path
from typing import Any

BUSY_LOAD = 0.3
"""Load per core before the run, above which other work disturbs it."""


def describe_computer(root: Path = Path("/")) -> dict[str, Any]:
    """Return names and numbers from the operating system."""
    cores = os.cpu_count() or 1
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "cpu": _cpu_name(root),
        "cores": cores,
        "frequency_MHz": _frequency_mhz(root),
        "os": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": platform.python_version(),
        "load_before": load,
        "busy": load is not None and load / cores > BUSY_LOAD,
    }


def _cpu_name(root: Path) -> str:
    found = re.search(r"^model name\s*:\s*(.+)$", _text(root / "proc/cpuinfo"), flags=re.MULTILINE)
    return found[1].strip() if found else platform.processor() or platform.machine()


def _frequency_mhz(root: Path) -> float | None:
    """Present clock frequency [MHz], None if the system does not state it; it may differ under load."""
    found = re.search(r"^cpu MHz\s*:\s*([0-9.]+)", _text(root / "proc/cpuinfo"), flags=re.MULTILINE)
    return round(float(found[1])) if found else None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
