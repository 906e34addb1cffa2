"""Questions that a new machine's `rig.toml` still asks: values that only somebody who knows the machine can give."""

import re
from dataclasses import dataclass

MARK = "?"
"""Stands in place of a value that has not been given yet."""

_QUESTION = re.compile(r"""^\s*([\w.-]+)\s*=[^#]*?["']\?["'][^#]*(?:#\s*(.*))?$""")
_TABLE = re.compile(r"^\s*\[+\s*([\w.-]+)\s*\]+")


@dataclass(frozen=True)
class Question:
    """One value that is missing."""

    line: int
    """In the file, from 1."""

    key: str
    """With the table that it stands in."""

    comment: str
    """How to answer it; empty where the line says nothing."""

    @property
    def sentence(self) -> str:
        """For whoever fills the file in."""
        return f"line {self.line}, {self.key}: {self.comment or 'not answered'}"


def open_questions(text: str) -> list[Question]:
    """All questions in the text of a `rig.toml`, in order."""
    found, table = [], ""
    for number, line in enumerate(text.splitlines(), start=1):
        if heading := _TABLE.match(line):
            table = heading[1] + "."
        elif question := _QUESTION.match(line):
            found.append(Question(number, table + question[1], (question[2] or "").strip()))
    return found
