"""Supervisor of the measuring processes, one per section: start, listen, and restart without an engine that crashed."""

import json
import os
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

FOLDER = Path(__file__).parents[1]
"""Folder that `peers` is imported from."""

STALLED_S = 300.0
"""Silence after which a process counts as hung [s]; XLA compiles the longest program in a tenth of it."""

CRASHES_MAX = 2
"""Crashes in one section after which an implementation is left out of the rest of the section."""

EVERY_ROW = "*"

Progress = Callable[[str, float], None]


@dataclass
class Findings:
    """Reports of all sections."""

    rows: list[dict[str, Any]] = field(default_factory=list)
    missing: list[dict[str, str]] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)
    memory: list[dict[str, Any]] = field(default_factory=list)
    limits: list[dict[str, Any]] = field(default_factory=list)
    peaks: dict[str, Any] = field(default_factory=dict)


def run_section(order: dict[str, Any], findings: Findings, progress: Progress) -> None:
    """Run a section to its end, even if engines in it crash."""
    order, crashes = {"done": [], "without": [], **order}, Counter()
    while True:
        listener = _Listener(findings, progress)
        reason = _run_process(order, listener)
        if reason is None:
            return
        row, who = listener.at
        crashes[who] += 1
        if row is None or (who is None and row in order["done"]) or crashes[who] > CRASHES_MAX:
            # The process died without a task in hand, or at an entry that was already left out: it would die again.
            findings.missing.append({"implementation": who or "all", "row": row or order["section"], "reason": reason})
            return
        order["done"] += listener.done
        if who is None:
            findings.missing.append({"implementation": "all", "row": row, "reason": reason})
            order["done"].append(row)
        else:
            order["without"].append([row if crashes[who] < CRASHES_MAX else EVERY_ROW, who, reason])


@dataclass
class _Listener:
    """Listener that sorts a process's reports into the findings."""

    findings: Findings
    progress: Progress
    at: tuple[str | None, str | None] = (None, None)
    """Row and implementation in hand; the implementation is None while all take turns."""

    done: list[str] = field(default_factory=list)

    def hear(self, words: dict[str, Any]) -> None:
        """Take one report."""
        match words:
            case {"row": row}:
                self.findings.rows.append(row)
            case {"missing": missing}:
                self.findings.missing.append(missing)
            case {"at": [row, who]}:
                self.at = (row, who)
            case {"done": name}:
                self.done.append(name)
                self.at = (None, None)
            case {"share": share, "text": text}:
                self.progress(text, share)
            case {"memory": memory}:
                self.findings.memory.append(memory)
            case {"limit": limit}:
                self.findings.limits.append(limit)
            case {"peaks": peaks}:
                self.findings.peaks = peaks
            case {"versions": versions}:
                self.findings.versions |= versions


def _run_process(order: dict[str, Any], listener: _Listener) -> str | None:
    """Listen to one process to its end; return the cause of its failure, None if it ended well."""
    command = [sys.executable, "-m", "peers.section_process", json.dumps(order)]
    paths = [str(FOLDER), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as errors:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=environment) as process:
            try:
                while line := _next_line(process):
                    listener.hear(json.loads(line))
                code = process.wait()
            finally:
                process.kill()
        return None if code == 0 else _ended(code, errors)


def _next_line(process: subprocess.Popen[str]) -> str:
    """Return the next line, empty at the end; kill a process that is silent for too long."""
    watchdog = threading.Timer(STALLED_S, process.kill)
    watchdog.start()
    try:
        return process.stdout.readline() if process.stdout is not None else ""
    finally:
        watchdog.cancel()


def _ended(code: int, errors: IO[str]) -> str:
    errors.seek(0)
    last = (errors.read().strip().splitlines() or ["without a message"])[-1]
    return f"its process was ended by signal {-code}" if code < 0 else f"its process failed: {last}"[:200]
