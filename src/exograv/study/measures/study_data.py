"""Data of a study for figures and pages: groups, compared touches, measures."""

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
"""Protocol of the study's primary outcome."""


@dataclass(frozen=True)
class StudyData:
    """Data of a study, before any figure or comparison is made."""

    settings: StudySettings
    tables: Tables
    measures: pd.DataFrame
    """Table with the columns `table.MEASURED`."""

    traces: pd.DataFrame
    """Table with the columns `traces.TRACES`."""

    @cached_property
    def group_of(self) -> dict[str, str]:
        """Group by participant's code."""
        people = self.tables.participants
        return dict(zip(people["participant"], people["group"].fillna(SEALED), strict=True))

    @property
    def is_sealed(self) -> bool:
        """Return True if the group of any participant is sealed. Then no group is shown."""
        return SEALED in self.group_of.values()

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """Groups with participants, in the order of the settings; a single one for all while groups are sealed."""
        if self.is_sealed:
            return (SEALED,)
        found = set(self.group_of.values())
        return (*(name for name in self.settings.groups if name in found), *sorted(found - set(self.settings.groups)))

    @cached_property
    def touches(self) -> pd.DataFrame:
        """Accepted touches (`pointing.counted`), with their `group`."""
        return self.with_group(counted(self.tables))

    @property
    def tidy_touches(self) -> pd.DataFrame:
        """Table `touches` with exactly the columns of the tidy table, as statistics take them."""
        return columns(self.touches, [one.name for one in TOUCHES])

    def with_group(self, table: pd.DataFrame) -> pd.DataFrame:
        """Add the column `group` to a table."""
        if self.is_sealed:
            return table.assign(group=SEALED)
        return table.assign(group=[self.group_of.get(code) for code in table["participant"]])

    @property
    def has_primary(self) -> bool:
        """Return True if any participant has touches in `PRIMARY`."""
        return PRIMARY in set(self.touches["protocol"])

    @cached_property
    def compared(self) -> pd.DataFrame:
        """Touches of `PRIMARY`; without any, those of each person's last session of any protocol."""
        touches = self.touches
        if self.has_primary:
            return rows(touches, touches["protocol"] == PRIMARY)
        last = touches.sort_values(["protocol", "session"]).groupby("participant")[["protocol", "session"]].tail(1)
        return touches.merge(touches.loc[last.index, ["participant", "protocol", "session"]])

    @property
    def compared_words(self) -> str:
        """Description of the touches in `compared`, as a part of a sentence."""
        return f"{PRIMARY} sessions" if self.has_primary else "last session of each person, as no participant flew"

    @property
    def is_simulated(self) -> bool:
        """Return True if any session is simulated. Then every result of the study says so."""
        return self.settings.is_simulated or bool(self.tables.sessions["is_simulated"].any())

    @cached_property
    def pitch_mm(self) -> float | None:
        """Size of a pixel, if all sessions had the same square pixels; None otherwise."""
        pitches = columns(self.tables.sessions, ["pitch_x_mm", "pitch_y_mm"]).to_numpy(float)
        if not pitches.size or np.isnan(pitches).any():
            return None
        low, high = float(pitches.min()), float(pitches.max())
        return 0.5 * (low + high) if high - low <= 0.01 * high else None

    def measure(self, name: str, level: str = "session") -> pd.DataFrame:
        """Return the rows of one measure that have a value, with `group`."""
        of = rows(self.measures, (self.measures["measure"] == name) & (self.measures["level"] == level))
        return self.with_group(rows(of, of["value"].notna()))
