"""Published values of the paper and of the aircraft's operator.

They keep our own choices from being called published.
"""

from collections.abc import Mapping, Sequence
from typing import Any


def _throughout(name: str, value: float) -> tuple[Any, ...]:
    """Possible entries for one level in all windows. The number of the first window, 0 or 1, is not published."""
    levels = (name, value)
    return tuple([{"window": first, "level": level, "end_level": None}] for first in (1, 0) for level in levels)


COMMON: dict[str, tuple[Any, ...]] = {
    "windows.duration_s": (22.0,),
    "windows.touches": (8,),
}
PUBLISHED: dict[str, dict[str, tuple[Any, ...]]] = {
    "training": COMMON
    | {
        "sessions": (16,),
        "exo": ("active",),
        "opening": ("clock",),
        "windows.count": (31,),
        "windows.levels": _throughout("weightless", 0.0),
        "pace.shown": (True,),
    },
    # The paper does not state if these sessions also have 31 windows.
    "familiarisation": COMMON
    | {
        "sessions": (4,),
        "exo": ("passive",),
        "opening": ("clock",),
        "windows.levels": _throughout("earth", 1.0),
        "pace.shown": (True,),
    },
    # Flight: 31 parabolas with 20 s of 1.8 g before and after, by ESA and Novespace; passive by the paper.
    "flight": COMMON
    | {
        "sessions": (1,),
        "exo": ("passive",),
        "windows.count": (31,),
        "windows.levels": _throughout("weightless", 0.0),
        "hypergravity.level": ("hyper", 1.8),
        "hypergravity.duration_s": (20.0,),
    },
}
"""Values by kind of session and path in the file. Source: docs/explanation/task.md."""


def is_under(path: str, marks: Sequence[str]) -> bool:
    """Return True if a mark names this value, or a table that contains it."""
    return any(path == mark or path.startswith(f"{mark}.") for mark in marks)


def refuse_unmarked(kind: str, leaves: Mapping[str, Any], unpublished: Sequence[str]) -> None:
    """Reject values that are neither as published nor marked as our choice.

    Raises:
        ValueError: A value is neither, or a mark names no value.
    """
    for mark in unpublished:
        if not any(is_under(path, (mark,)) for path in leaves):
            raise ValueError(f"unpublished names '{mark}', which is not in this file")
    for path, value in leaves.items():
        if is_under(path, unpublished) or value is None:
            continue
        allowed = PUBLISHED[kind].get(path)
        if allowed is None:
            raise ValueError(f"{path} is {value!r}: no source gives it. Add '{path}' to unpublished")
        if value not in allowed:
            raise ValueError(
                f"{path} is {value!r}, the published value is {allowed[0]!r}. Correct it, or add '{path}' to "
                "unpublished"
            )
