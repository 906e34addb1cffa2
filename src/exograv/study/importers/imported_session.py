"""Imported session that every importer returns: the rows of one session, and the rows that could not be used."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

Row = Mapping[str, Any]


class SessionKey(NamedTuple):
    """Key of a session."""

    participant: str
    protocol: str
    session: int


@dataclass(frozen=True)
class StatedSession:
    """Statements of a source or a user about the session; None for each that is missing."""

    participant: str | None = None
    protocol: str | None = None
    session: int | None = None

    def over(self, other: "StatedSession") -> "StatedSession":
        """Return the fields of this session; a field that is None gets its value from `other`."""
        mine = {name: value for name, value in vars(self).items() if value is not None}
        return replace(other, **mine)

    @property
    def missing(self) -> list[str]:
        """Names of the fields that are None."""
        return [name for name, value in vars(self).items() if value is None]


@dataclass(frozen=True)
class Imported:
    """Rows of one session, without the key, which the study adds."""

    session: Row
    """Row of `SESSIONS`, without `source`, `sha256` and `acquired`."""

    windows: Sequence[Row]
    touches: Sequence[Row]
    said: StatedSession = StatedSession()
    body: Mapping[str, Any] = field(default_factory=dict)
    """Body data `height_m`, `mass_kg`, `sex` of the source, for a comparison with the participant's record."""

    refusals: Sequence[str] = ()
    """Refused rows: position and reason. No cell is repeated."""


def counted(windows: Sequence[Row], touches: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the windows with the numbers of their accepted and rejected touches."""
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
    """Return the totals of a session's windows and touches."""
    accepted = sum(bool(touch["is_accepted"]) for touch in touches)
    complete = {one["window"] for one in windows if one["is_complete"]}
    return {"windows_complete": len(complete), "touches": accepted, "rejected": len(touches) - accepted}


def sentences(*parts: str | None) -> str | None:
    """Join several remarks into one; None if there are none."""
    return " ".join(part for part in parts if part) or None
