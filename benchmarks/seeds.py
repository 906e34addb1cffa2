"""Seeds of a benchmark as an argument, and results that earlier runs saved."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def seed_range(text: str) -> range:
    """Seeds of "first-last" or of one number; none for an empty text."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1) if first else range(0)


def loaded(paths: Sequence[Path]) -> list[Any]:
    """Results of all files of `--save`, in one list."""
    return [result for path in paths for result in json.loads(path.read_text())]
