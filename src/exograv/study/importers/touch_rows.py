"""Rows of `TOUCHES` from cells of other software. A row that cannot be used gives its reason."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from exograv.study.folder.columns import TOUCHES
from exograv.task.pace import Pace
from exograv.task.pointing import RejectionReason

from .imported_session import counted, totals

WHO = ("participant", "protocol", "session")
NEEDED = ("window", "t_s", "x_px", "y_px")
TARGET = ("target_x_px", "target_y_px")
DEVIATION = ("deviation_x_px", "deviation_y_px")
"""Columns of the deviation. A file needs this pair or `TARGET`; if it has both, they must be consistent."""

COMPUTED = ("deviation_px", "deviation_mm")
OPTIONAL = tuple(c.name for c in TOUCHES if c.name not in (*WHO, *NEEDED, *DEVIATION, *COMPUTED))
COLUMNS = (*WHO, *NEEDED, *TARGET, *DEVIATION, *OPTIONAL)
"""All columns that a CSV of touches may have."""

AGREE_PX = 0.51
"""Largest difference between a deviation and contact minus target [px]: both may be rounded to whole pixels."""

WHOLE = tuple(c.name for c in TOUCHES if c.kind == "int64")
MISSING = frozenset({"", "na", "n/a", "nan"})
WORDS: dict[str, dict[str, Any]] = {
    "pace": {pace.value: pace.value for pace in Pace},
    "reason": {reason.value: reason.value for reason in RejectionReason},
    "is_accepted": {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False},
}
"""Accepted words by column. Free text is refused, because it could be a remark about a person."""

PAGE = re.compile(r"(imported|page|screen|simulated|tablet)?[-_]?[0-9]{0,9}")


class UnusableError(Exception):
    """Row that cannot be used. The message gives the reason, without the row's cells."""


def touch_row(cells: Mapping[str, str], number: Callable[[str], float | None], line: int) -> dict[str, Any]:
    """Return a row of `TOUCHES` without key.

    Args:
        cells: Cells by column of `COLUMNS`.
        number: Reads a number from a cell; None if the cell holds none.
        line: Position of the row; used as its number in the sequence if the row has none.

    Raises:
        UnusableError: A value is missing or invalid.
    """
    told = {name: _value(name, cells[name], number) for name in COLUMNS if name in cells and name not in WHO}
    for name in NEEDED:
        if told.get(name) is None:
            raise UnusableError(f"{name} is missing")
    off_x, off_y = _deviation(told, "x"), _deviation(told, "y")
    x_mm, y_mm = told.get("deviation_x_mm"), told.get("deviation_y_mm")
    norm_mm = None if x_mm is None or y_mm is None else math.hypot(x_mm, y_mm)
    rest = {name: told.get(name) for name in OPTIONAL}
    is_accepted = rest["is_accepted"] is not False
    return {
        **rest,
        **{name: told[name] for name in NEEDED},
        "attempt": rest["attempt"] or 1,
        "sequence": line if rest["sequence"] is None else rest["sequence"],
        "page": rest["page"] or "imported",
        "is_accepted": is_accepted,
        "reason": rest["reason"] if is_accepted else rest["reason"] or "not told",
        "deviation_x_px": off_x,
        "deviation_y_px": off_y,
        "deviation_px": math.hypot(off_x, off_y),
        "deviation_mm": norm_mm,
    }


def _value(name: str, cell: str, number: Callable[[str], float | None]) -> Any:
    cell = cell.strip()
    if cell.lower() in MISSING:
        return None
    if name in WORDS:
        if cell.lower() not in WORDS[name]:
            raise UnusableError(f"{name} is not one of {', '.join(WORDS[name])}")
        return WORDS[name][cell.lower()]
    if name == "page":
        if not PAGE.fullmatch(cell):
            raise UnusableError(f"{name} is not a number, or page, screen or tablet with a number")
        return cell
    found = number(cell)
    if found is None or not math.isfinite(found):
        raise UnusableError(f"{name} is not a number")
    if name in WHOLE:
        if found != int(found) or found < 0:
            raise UnusableError(f"{name} is not a whole number of 0 or more")
        return int(found)
    return found


def _deviation(told: Mapping[str, Any], axis: str) -> float:
    """Return contact minus target along an axis [px]."""
    target, said = told.get(f"target_{axis}_px"), told.get(f"deviation_{axis}_px")
    if target is None:
        if said is None:
            raise UnusableError(f"target_{axis}_px and deviation_{axis}_px are missing")
        return said
    found = told[f"{axis}_px"] - target
    if said is not None and abs(found - said) > AGREE_PX:
        raise UnusableError(f"deviation_{axis}_px is not {axis}_px minus target_{axis}_px")
    return found


def windows_of_touches(touches: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return rows of `WINDOWS` if only touches are known. A window then lasts from its first touch to its last."""
    rows = dict[tuple[int, int], dict[str, Any]]()
    for touch in sorted(touches, key=lambda one: one["t_s"]):
        place = (touch["window"], touch["attempt"])
        opened = touch["t_s"] - (touch["interval_s"] or 0.0)
        row = rows.setdefault(
            place,
            {
                "window": place[0],
                "attempt": place[1],
                "opened_s": opened,
                "opened_by": "unknown",
                "closed_by": None,
                "is_complete": True,
                "marks": "",
                "gravity_level": touch["gravity_level"],
                "g_median": None,
            },
        )
        row["closed_s"] = touch["t_s"]
    return counted(list(rows.values()), touches)


def session_of_touches(
    kind: str, windows: Sequence[Mapping[str, Any]], touches: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return a row of `SESSIONS` if only touches are known, without its remark."""
    times = [touch["t_s"] for touch in touches]
    return {
        "kind": kind,
        "is_simulated": False,
        "is_complete": False,
        "duration_s": max(times) - min(0.0, *times),
        **totals(windows, touches),
        "ticks": 0,
        "clock_jumps": sum(later < earlier for earlier, later in pairwise(times)),
        "stops": 0,
    }
