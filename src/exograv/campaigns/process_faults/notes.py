"""Notes of the struck processes for the campaign: lines of JSON that outlive the process that wrote them."""

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FILE = "notes.jsonl"


def write_note(folder: str | Path, kind: str, **values: Any) -> None:
    """Append a note with the present time on CLOCK_MONOTONIC [s], in one write."""
    line = json.dumps({"kind": kind, "t": time.monotonic(), **values}) + "\n"
    file = os.open(Path(folder) / FILE, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    try:
        os.write(file, line.encode())
    finally:
        os.close(file)


def read_notes(folder: str | Path) -> Iterator[dict[str, Any]]:
    """Yield all complete notes so far."""
    path = Path(folder) / FILE
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines(keepends=True):
            if line.endswith("\n"):
                yield json.loads(line)
