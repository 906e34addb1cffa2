"""What may be said aloud of a file or a code that somebody gave: nothing that could be a person's name."""

import re
from pathlib import Path

from exograv.study.participants.codes import is_code

OTHER_CODE = re.compile(r"[A-Za-z]{1,3}[-_]?\d{1,4}")
"""Such as P-02: of a recording that was made under another code. Longer words could be names."""

WORDS = frozenset(
    {"training", "familiarisation", "flight", "first", "session", "run", "recording", "touches", "data", "windows"}
    | {"study", "export", "test", "sub", "ses", "task", "mcap", "csv", "tsv", "xdf", "xdfz", "p", "s"}
)
"""Parts of a file's name that tell nobody."""


def looks_like_code(text: str) -> bool:
    """Ours, or one that somebody else gave; a name does not look so."""
    return is_code(text) or OTHER_CODE.fullmatch(text) is not None


def shown_file(path: Path, number: int, of: int) -> str:
    """A file's name where all of it is codes, numbers and words that tell nobody; else which of those given it is."""
    parts = [part for part in re.split(r"[_.\-\s]+", path.name) if part]
    is_plain = all(part.lower() in WORDS or part.isdecimal() or is_code(part) for part in parts)
    return path.name if is_plain else f"file {number} of {of} ({path.suffix.lower() or 'without suffix'})"
