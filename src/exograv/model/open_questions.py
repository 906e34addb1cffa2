"""Open questions in a new machine's `rig.toml`: values that only a person who knows the machine can give."""

import re
from dataclasses import dataclass

MARK = "?"
"""Placeholder of a value that is not given yet."""

_QUESTION = re.compile(r"""^\s*([\w.-]+)\s*=[^#]*?["']\?["'][^#]*(?:#\s*(.*))?$""")
_TABLE = re.compile(r"^\s*\[+\s*([\w.-]+)\s*\]+")


@dataclass(frozen=True)
class Question:
    """Value that is missing in `rig.toml`, with the question to the builder."""

    line: int
    """Line in the file, from 1."""

    key: str
    """Key with the name of its table."""

    comment: str
    """Instruction from the line's comment; empty if there is none."""

    @property
    def sentence(self) -> str:
        """Sentence for the person who fills in the file."""
        return f"line {self.line}, {self.key}: {self.comment or 'not answered'}"


def open_questions(text: str) -> list[Question]:
    """Find all questions in the text of a `rig.toml`, in order."""
    found, table = [], ""
    for number, line in enumerate(text.splitlines(), start=1):
        if heading := _TABLE.match(line):
            table = heading[1] + "."
        elif question := _QUESTION.match(line):
            found.append(Question(number, table + question[1], (question[2] or "").strip()))
    return found
