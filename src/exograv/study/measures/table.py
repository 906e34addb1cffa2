"""Long table of all measures of a study: one row per measure of a touch, a window, a session or a person."""

from collections.abc import Iterator, Mapping
from typing import Any, cast

import pandas as pd

from exograv.study.dataset.tables import Tables, frame
from exograv.study.folder.columns import KEY, Column

from .catalogue import Level, measure
from .learning import IntervalEstimate, participant_learning, session_learning
from .pointing import ATTEMPT, counted, deviations, directions_deg, session_measures, window_measures

MEASURED = (
    KEY[0],
    KEY[1],
    Column("session", "int64", "-", "number of the session; NA for a measure over sessions", is_nullable=True),
    Column("window", "int64", "-", "number of the window; NA for a measure over windows", is_nullable=True),
    Column("attempt", "int64", "-", "number of the attempt at the window", is_nullable=True),
    Column("sequence", "int64", "-", "number of the touch in its sequence", is_nullable=True),
    Column("page", "string", "-", "page of the touch", is_nullable=True),
    Column("level", "string", "-", "`touch`, `window`, `session` or `participant`"),
    Column("measure", "string", "-", "name of the measure, as in the catalogue"),
    Column("unit", "string", "-", "unit of value and interval"),
    Column("value", "float64", "unit", "value; NA if it cannot be computed", is_nullable=True),
    Column("low", "float64", "unit", "lower end of the 95 % interval, if the measure has one", is_nullable=True),
    Column("high", "float64", "unit", "upper end of that interval", is_nullable=True),
)
"""Columns of the table `measures.parquet`."""

SESSION = ATTEMPT[:3]
Row = dict[str, Any]


def rows_of(level: Level, key: Mapping[str, Any], values: Mapping[str, float | IntervalEstimate]) -> Iterator[Row]:
    """Yield one row per measure, with its unit."""
    for name, value in values.items():
        estimate = value if isinstance(value, IntervalEstimate) else IntervalEstimate(float(value))
        yield {
            **key,
            "level": level,
            "measure": name,
            "unit": measure(name, level).unit,
            "value": estimate.value,
            "low": estimate.low,
            "high": estimate.high,
        }


def measures_of(tables: Tables) -> pd.DataFrame:
    """Compute all measures that need only the tidy tables, with the columns `MEASURED`.

    Measures from recordings are in `recordings.py`.
    """
    touches = counted(tables)
    rows = [row for part in (_of_touches, _of_windows) for row in part(touches)]
    by_session = list(_of_sessions(touches, tables.windows))
    return frame(MEASURED, [*rows, *by_session, *_of_participants(by_session)])


def _of_touches(touches: pd.DataFrame) -> Iterator[Row]:
    directions = directions_deg(deviations(touches, "px"))
    for direction, touch in zip(directions, touches.to_dict("records"), strict=True):
        key = {name: touch[name] for name in (*ATTEMPT, "sequence", "page")}
        values = {name: touch[name] for name in ("deviation_px", "deviation_mm")}
        yield from rows_of("touch", key, {**values, "direction_deg": direction})


def _of_windows(touches: pd.DataFrame) -> Iterator[Row]:
    for key, group in touches.groupby(ATTEMPT):
        yield from rows_of("window", dict(zip(ATTEMPT, cast(tuple, key), strict=True)), window_measures(group))


def _of_sessions(touches: pd.DataFrame, windows: pd.DataFrame) -> Iterator[Row]:
    complete = windows[windows["is_complete"]].groupby(SESSION)["window"].nunique()
    for key, group in touches.groupby(SESSION):
        names = dict(zip(SESSION, cast(tuple, key), strict=True))
        values = {**session_measures(group, int(complete.loc[key])), **session_learning(group)}
        yield from rows_of("session", names, values)


def _of_participants(by_session: list[Row]) -> Iterator[Row]:
    medians = [row for row in by_session if row["measure"] == "median_deviation_px"]
    if not medians:
        return
    for key, group in pd.DataFrame(medians).groupby(SESSION[:2]):
        names = dict(zip(SESSION[:2], cast(tuple, key), strict=True))
        values = participant_learning(group["session"].to_numpy(float), group["value"].to_numpy(float))
        yield from rows_of("participant", names, values)
