"""Text of a CSV as rows of cells: delimiter and decimal comma found out, or refused where they are not certain."""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from exograv.errors import RecordingError

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
WITH_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
MISSING = frozenset({"", "NA", "n/a", "NaN", "nan"})


@dataclass(frozen=True)
class CsvSheet:
    """A file, line by line."""

    header: bytes
    """As it stands, with its end of line."""

    columns: tuple[str, ...]
    delimiter: str
    has_decimal_comma: bool
    lines: tuple[tuple[int, bytes], ...]
    """Number, counted from 1, and bytes of each line that is not empty."""

    def rows(self) -> Iterator[tuple[int, bytes, dict[str, str] | str]]:
        """Number and bytes of a line, and its cells by column, or why it has none."""
        for number, line in self.lines:
            cells = _cells(line, self.delimiter)
            if isinstance(cells, list) and len(cells) != len(self.columns):
                cells = f"it has {len(cells)} cells, and there are {len(self.columns)} columns"
            if isinstance(cells, str):
                yield number, line, cells
            else:
                yield number, line, dict(zip(self.columns, cells, strict=True))

    def number(self, cell: str) -> float | None:
        """What a cell says; None where it is no number."""
        cell = cell.strip()
        if self.has_decimal_comma and WITH_COMMA.fullmatch(cell):
            cell = cell.replace(",", ".")
        return float(cell) if NUMBER.fullmatch(cell) else None


def read_sheet(content: bytes, known: Sequence[str]) -> CsvSheet:
    """Find out how the file is written.

    Args:
        content: Of the file.
        known: Columns that there may be.

    Raises:
        RecordingError: It is no such text, or its delimiter or its decimals are not certain.
    """
    text = content.removeprefix(b"\xef\xbb\xbf")
    try:
        text.decode()
    except UnicodeDecodeError as error:
        raise RecordingError(f"It is no UTF-8 text (byte {error.start}). Save it as CSV, UTF-8.") from None
    whole = text.splitlines(keepends=True)
    lines = tuple((number, line) for number, line in enumerate(whole, start=1) if line.strip())
    if not lines:
        raise RecordingError("It is empty. Give a file with a line of column names and a line for each touch.")
    (_, header), *rest = lines
    delimiter = _delimiter(header, known)
    names = _cells(header, delimiter)
    columns = () if isinstance(names, str) else tuple(name.strip() for name in names)
    if len(set(columns)) < len(columns):
        raise RecordingError("A column is there twice. Each name may stand once in the first line.")
    return CsvSheet(header, columns, delimiter, _has_decimal_comma(rest, delimiter), tuple(rest))


def _delimiter(header: bytes, known: Sequence[str]) -> str:
    found = {}
    for delimiter in DELIMITERS:
        names = _cells(header, delimiter)
        found[delimiter] = 0 if isinstance(names, str) else sum(name.strip() in known for name in names)
    best = max(found, key=lambda one: found[one])
    if found[best] < 2:
        raise RecordingError(
            f"Its first line does not name columns of touches, separated by {', '.join(DELIMITERS.values())}. "
            f"Known are {', '.join(known)}."
        )
    return best


def _has_decimal_comma(lines: Sequence[tuple[int, bytes]], delimiter: str) -> bool:
    """Whether numbers have a comma; the whole file is asked."""
    if delimiter == ",":
        return False
    comma = point = 0
    for number, line in lines:
        cells = _cells(line, delimiter)
        for cell in () if isinstance(cells, str) else cells:
            cell = cell.strip()
            comma, point = (
                comma or number * bool(WITH_COMMA.fullmatch(cell)),
                point or number * bool("." in cell and NUMBER.fullmatch(cell)),
            )
    if comma and point:
        raise RecordingError(
            f"Line {comma} has a decimal comma and line {point} a decimal point. Export it again with one of them."
        )
    return bool(comma)


def _cells(line: bytes, delimiter: str) -> list[str] | str:
    try:
        return next(csv.reader([line.decode().rstrip("\r\n")], delimiter=delimiter, strict=True))
    except csv.Error:
        return "its quotes are not closed"
