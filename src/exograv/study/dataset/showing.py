"""Display of file names and codes that were given by a user, without any part that could be a person's name."""

import re
from pathlib import Path

from exograv.study.participants.codes import is_code

OTHER_CODE = re.compile(r"[A-Za-z]{1,3}[-_]?\d{1,4}")
"""Form of a code of another software, such as P-02. Longer words could be names."""

WORDS = frozenset(
    {"training", "familiarisation", "flight", "first", "session", "run", "recording", "touches", "data", "windows"}
    | {"study", "export", "test", "sub", "ses", "task", "mcap", "csv", "tsv", "xdf", "xdfz", "p", "s"}
)
"""Parts of a file's name that identify no person."""


def looks_like_code(text: str) -> bool:
    """Return True if the text has the form of our codes or of another software's code. A name has no such form."""
    return is_code(text) or OTHER_CODE.fullmatch(text) is not None


def shown_file(path: Path, number: int, of: int) -> str:
    """Return a file's name if it consists of codes, numbers and neutral words; else its number among the files."""
    parts = [part for part in re.split(r"[_.\-\s]+", path.name) if part]
    is_plain = all(part.lower() in WORDS or part.isdecimal() or is_code(part) for part in parts)
    return path.name if is_plain else f"file {number} of {of} ({path.suffix.lower() or 'without suffix'})"
