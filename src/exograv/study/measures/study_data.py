"""A study as figures and pages take it: who is in which group, which touches are compared, what was measured."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from exograv.study.dataset.tables import Tables
from exograv.study.folder.columns import TOUCHES
from exograv.study.folder.settings import StudySettings
from exograv.study.participants.participant_record import SEALED

from .pointing import counted
from .selecting import columns, rows

PRIMARY = "flight"
"""Protocol whose deviations the study was made for."""


@dataclass(frozen=True)
class StudyData:
    """Nothing here is drawn or compared yet."""

    settings: StudySettings
    tables: Tables
    measures: pd.DataFrame
    """With the columns of `table.MEASURED`."""

    traces: pd.DataFrame
    """With the columns of `traces.TRACES`."""

    @cached_property
    def group_of(self) -> dict[str, str]:
        """By participant's code."""
        people = self.tables.participants
        return dict(zip(people["participant"], people["group"].fillna(SEALED), strict=True))

    @property
    def is_sealed(self) -> bool:
        """Somebody's group is not to be known: then nobody's is told."""
        return SEALED in self.group_of.values()

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """That somebody is in, in the order of the settings; one of all, where groups are sealed."""
        if self.is_sealed:
            return (SEALED,)
        found = set(self.group_of.values())
        return (*(name for name in self.settings.groups if name in found), *sorted(found - set(self.settings.groups)))

    @cached_property
    def touches(self) -> pd.DataFrame:
        """Those that count (`pointing.counted`), with their `group`."""
        return self.with_group(counted(self.tables))

    @property
    def tidy_touches(self) -> pd.DataFrame:
        """`touches` with exactly the columns of the tidy table, as statistics take them."""
        return columns(self.touches, [one.name for one in TOUCHES])

    def with_group(self, table: pd.DataFrame) -> pd.DataFrame:
        """The table with a column `group`."""
        if self.is_sealed:
            return table.assign(group=SEALED)
        return table.assign(group=[self.group_of.get(code) for code in table["participant"]])

    @property
    def has_primary(self) -> bool:
        """Somebody flew."""
        return PRIMARY in set(self.touches["protocol"])

    @cached_property
    def compared(self) -> pd.DataFrame:
        """Touches of `PRIMARY`; without any, of each person's last session, whatever it was."""
        touches = self.touches
        if self.has_primary:
            return rows(touches, touches["protocol"] == PRIMARY)
        last = touches.sort_values(["protocol", "session"]).groupby("participant")[["protocol", "session"]].tail(1)
        return touches.merge(touches.loc[last.index, ["participant", "protocol", "session"]])

    @property
    def compared_words(self) -> str:
        """What `compared` is."""
        return f"{PRIMARY} sessions" if self.has_primary else "last session of each person, as nobody flew"

    @property
    def is_simulated(self) -> bool:
        """Any session is: then all that is made of the study says so."""
        return self.settings.is_simulated or bool(self.tables.sessions["is_simulated"].any())

    @cached_property
    def pitch_mm(self) -> float | None:
        """Of a pixel, where all sessions had the same square one; None otherwise."""
        pitches = columns(self.tables.sessions, ["pitch_x_mm", "pitch_y_mm"]).to_numpy(float)
        if not pitches.size or np.isnan(pitches).any():
            return None
        low, high = float(pitches.min()), float(pitches.max())
        return 0.5 * (low + high) if high - low <= 0.01 * high else None

    def measure(self, name: str, level: str = "session") -> pd.DataFrame:
        """Rows of one measure that could be had, with `group`."""
        of = rows(self.measures, (self.measures["measure"] == name) & (self.measures["level"] == level))
        return self.with_group(rows(of, of["value"].notna()))
