"""Cells of a CSV file. Delimiter and decimal comma are detected, and ambiguous files are refused."""

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
    """Lines of a CSV file."""

    header: bytes
    """First line as it is in the file, with its end of line."""

    columns: tuple[str, ...]
    delimiter: str
    has_decimal_comma: bool
    lines: tuple[tuple[int, bytes], ...]
    """Number, counted from 1, and bytes of each line that is not empty."""

    def rows(self) -> Iterator[tuple[int, bytes, dict[str, str] | str]]:
        """Yield number and bytes of each line, and its cells by column, or the reason why it has none."""
        for number, line in self.lines:
            cells = _cells(line, self.delimiter)
            if isinstance(cells, list) and len(cells) != len(self.columns):
                cells = f"the line has {len(cells)} cells, but there are {len(self.columns)} columns"
            if isinstance(cells, str):
                yield number, line, cells
            else:
                yield number, line, dict(zip(self.columns, cells, strict=True))

    def number(self, cell: str) -> float | None:
        """Return the number in a cell; None if the cell holds no number."""
        cell = cell.strip()
        if self.has_decimal_comma and WITH_COMMA.fullmatch(cell):
            cell = cell.replace(",", ".")
        return float(cell) if NUMBER.fullmatch(cell) else None


def read_sheet(content: bytes, known: Sequence[str]) -> CsvSheet:
    """Detect the format of the file.

    Args:
        content: Bytes of the file.
        known: Names of the allowed columns.

    Raises:
        RecordingError: The content is not such a text, or its delimiter or decimal sign is ambiguous.
    """
    text = content.removeprefix(b"\xef\xbb\xbf")
    try:
        text.decode()
    except UnicodeDecodeError as error:
        raise RecordingError(f"The file is not UTF-8 text (byte {error.start}). Save it as CSV, UTF-8.") from None
    whole = text.splitlines(keepends=True)
    lines = tuple((number, line) for number, line in enumerate(whole, start=1) if line.strip())
    if not lines:
        raise RecordingError("The file is empty. Give a file with a line of column names and a line for each touch.")
    (_, header), *rest = lines
    delimiter = _delimiter(header, known)
    names = _cells(header, delimiter)
    columns = () if isinstance(names, str) else tuple(name.strip() for name in names)
    if len(set(columns)) < len(columns):
        raise RecordingError("Two columns have the same name. Each name may occur once in the first line.")
    return CsvSheet(header, columns, delimiter, _has_decimal_comma(rest, delimiter), tuple(rest))


def _delimiter(header: bytes, known: Sequence[str]) -> str:
    found = {}
    for delimiter in DELIMITERS:
        names = _cells(header, delimiter)
        found[delimiter] = 0 if isinstance(names, str) else sum(name.strip() in known for name in names)
    best = max(found, key=lambda one: found[one])
    if found[best] < 2:
        raise RecordingError(
            f"The first line does not name columns of touches, separated by {', '.join(DELIMITERS.values())}. "
            f"Known columns: {', '.join(known)}."
        )
    return best


def _has_decimal_comma(lines: Sequence[tuple[int, bytes]], delimiter: str) -> bool:
    """Return True if numbers have a decimal comma. The whole file is checked."""
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
            f"Line {comma} has a decimal comma and line {point} a decimal point. Export the file again with only one "
            "of the two."
        )
    return bool(comma)


def _cells(line: bytes, delimiter: str) -> list[str] | str:
    try:
        return next(csv.reader([line.decode().rstrip("\r\n")], delimiter=delimiter, strict=True))
    except csv.Error:
        return "a quote in the line is not closed"
