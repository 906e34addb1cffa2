"""What every importer hands over: the rows of one session, and what it could not use."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

Row = Mapping[str, Any]


class SessionKey(NamedTuple):
    """Which session it is."""

    participant: str
    protocol: str
    session: int


@dataclass(frozen=True)
class StatedSession:
    """What a source, or somebody at the keyboard, says of the session; None where nothing is said."""

    participant: str | None = None
    protocol: str | None = None
    session: int | None = None

    def over(self, other: "StatedSession") -> "StatedSession":
        """The same, completed by the other."""
        mine = {name: value for name, value in vars(self).items() if value is not None}
        return replace(other, **mine)

    @property
    def missing(self) -> list[str]:
        """What is still to be said."""
        return [name for name, value in vars(self).items() if value is None]


@dataclass(frozen=True)
class Imported:
    """One session; its rows lack the key, which the study gives."""

    session: Row
    """Of `SESSIONS`, without `source`, `sha256` and `acquired`."""

    windows: Sequence[Row]
    touches: Sequence[Row]
    said: StatedSession = StatedSession()
    body: Mapping[str, Any] = field(default_factory=dict)
    """`height_m`, `mass_kg`, `sex` as the source has them: for a comparison with what the study was told."""

    refusals: Sequence[str] = ()
    """Rows that were not used: where, and why; no cell is repeated."""


def counted(windows: Sequence[Row], touches: Sequence[Row]) -> list[dict[str, Any]]:
    """Windows with the number of their touches that count, and of those that do not."""
    found = {(one["window"], one["attempt"]): [0, 0] for one in windows}
    for touch in touches:
        place = (touch["window"], touch["attempt"])
        if place in found:
            found[place][not touch["is_accepted"]] += 1
    return [
        {**one, "touches": found[one["window"], one["attempt"]][0], "rejected": found[one["window"], one["attempt"]][1]}
        for one in windows
    ]


def totals(windows: Sequence[Row], touches: Sequence[Row]) -> dict[str, int]:
    """What a session says of its windows and touches."""
    accepted = sum(bool(touch["is_accepted"]) for touch in touches)
    complete = {one["window"] for one in windows if one["is_complete"]}
    return {"windows_complete": len(complete), "touches": accepted, "rejected": len(touches) - accepted}


def sentences(*parts: str | None) -> str | None:
    """One remark of several; None where there is none."""
    return " ".join(part for part in parts if part) or None
