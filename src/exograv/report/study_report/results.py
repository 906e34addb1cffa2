"""Tables of results: each person, and every measure by group. The tables describe the data and test nothing."""

import numpy as np
import pandas as pd

from exograv.report.study_figures.groups import label
from exograv.report.style.page import Table
from exograv.study.measures.catalogue import MEASURES, Measure
from exograv.study.measures.catalogue import measure as measure_of
from exograv.study.measures.selecting import column, columns, keys, middle, rows
from exograv.study.measures.study_data import StudyData
from exograv.study.measures.table import SESSION
from exograv.study.statistics.findings import Interval, StudyFindings
from exograv.study.statistics.multiple import Family, family_of_sessions
from exograv.study.statistics.relabelling import relabellings

NOT_SHOWN = {"deviation_px", "deviation_mm", "direction_deg", "touches", "mean_direction_deg", "ellipse_angle_deg"}
"""Measures whose median over people has no meaning, or which are shown elsewhere."""


def people_table(data: StudyData) -> Table:
    """Return touches and deviation of each person in the compared sessions."""
    lines = []
    for code, touches in data.compared.groupby("participant"):
        quartiles = np.quantile(column(touches, "deviation_px").to_numpy(float), (0.25, 0.5, 0.75))
        has_mm = not column(touches, "deviation_mm").isna().sum()
        lines.append(
            (
                str(code),
                label(str(touches["group"].iloc[0])),
                str(len(touches)),
                number(quartiles[1]),
                f"{number(quartiles[0])} to {number(quartiles[2])}",
                number(middle(touches, "deviation_mm")) if has_mm else "",
            )
        )
    heads = ("participant", "group", "touches", "median [px]", "quartiles [px]", "median [mm]")
    return Table(heads, sorted(lines, key=lambda row: (row[1], row[0])))


def measures_table(data: StudyData) -> Table:
    """Return one row per measure of the compared sessions: median, smallest and largest value over people."""
    lines = []
    of_sessions = {measure.name for measure in MEASURES if measure.level == "session"}
    for measure in MEASURES:
        # While groups are sealed, measures of the machine would reveal who is in which group.
        is_telling = measure.name in ("carried_share", "motor_torque_rms_Nm") and data.is_sealed
        is_twice = measure.level != "session" and measure.name in of_sessions
        if measure.name in NOT_SHOWN or is_telling or is_twice:
            continue
        for protocol, values in _by_person(data, measure).items():
            cells = [_summary(column(rows(values, values["group"] == group), "value")) for group in data.groups]
            lines.append((with_unit(measure, protocol), *cells, measure.meaning))
    return Table(("measure", *(label(group) for group in data.groups), "meaning"), lines)


def _by_person(data: StudyData, measure: Measure) -> dict[str, pd.DataFrame]:
    """Return one value per person, the median over the compared sessions; a measure over sessions by protocol."""
    of = data.measure(measure.name, measure.level)
    if of.empty:
        return {}
    if measure.level == "participant":
        return {f", {name}": rows(of, of["protocol"] == name) for name in sorted(set(of["protocol"]))}
    of = of.merge(columns(data.compared, SESSION).drop_duplicates().astype({"session": "Int64"}), on=SESSION)
    return {"": of.groupby(["group", "participant"])["value"].median().reset_index()} if len(of) else {}


def _summary(values: pd.Series) -> str:
    if values.empty:
        return "none"
    if len(values) == 1:
        return number(float(values.iloc[0]))
    return f"{number(float(values.median()))} ({number(float(values.min()))} to {number(float(values.max()))})"


def number(value: float) -> str:
    """Format with three significant digits and a minus sign."""
    text = f"{value:.3g}" if 1e-3 <= abs(value) < 1e4 or value == 0.0 else f"{value:.2e}"
    return f"{float(text):g}".replace("-", "−")


def with_unit(measure: Measure, of: str = "") -> str:
    """Return the name of a measure as text, with its object and its unit."""
    return f"{in_words(measure.name)}{of}" + ("" if measure.unit == "-" else f" [{measure.unit}]")


def in_words(name: str) -> str:
    """Return a measure's name without its unit."""
    units = ("_px", "_mm", "_s", "_m", "_rad", "_deg", "_Nm", "_m_per_s", "_rad_per_s")
    for unit in sorted(units, key=len, reverse=True):
        name = name.removesuffix(unit) if name.endswith(unit) else name
    return name.replace("_", " ")


def family_of(data: StudyData, found: StudyFindings) -> Family | None:
    """Test all measures of the compared sessions together; None with fewer than two people in a group."""
    first, second = (sum(person.group == group for person in found.people) for group in found.groups)
    if min(first, second) < 2:
        return None
    ways = relabellings(first, second, np.random.default_rng(0))
    # A difference of directions has no meaning, because directions are circular.
    straight = rows(data.measures, ~data.measures["measure"].isin(list(NOT_SHOWN)))
    return family_of_sessions(straight, found.people, found.protocol, ways, f"Measures of a {found.protocol}")


def family_rows(family: Family) -> list[tuple[str, ...]]:
    """Return the rows of the family, smallest p first."""
    lines = keys(family.table, ["p", "measure", "difference", "p_holm", "p_max_t"])
    return [
        (with_unit(measure_of(name, "session")), *(number(value) for value in (difference, p, holm, max_t)))
        for p, name, difference, holm, max_t in sorted(lines)
    ]


def test_rows(found: StudyFindings) -> list[tuple[str, ...]]:
    """Return the rows of the tests, primary first."""
    return [(one.name, one.text, one.sentence) for one in (found.primary, *found.other_tests)]


def effect_rows(found: StudyFindings) -> list[tuple[str, ...]]:
    """Return the rows of the effects, primary first."""
    return [
        (
            one.name,
            "" if one.value is None else f"{number(one.value)} {one.unit}".removesuffix(" -"),
            "" if one.interval is None else f"{interval_words(one.interval)}, {one.interval.method}",
            one.meaning,
        )
        for one in (found.effect, *found.other_effects)
    ]


def interval_words(interval: Interval) -> str:
    """Format an interval as `95 % interval 0.3 to 0.6`."""
    low = "unbounded" if interval.low is None else number(interval.low)
    high = "unbounded" if interval.high is None else number(interval.high)
    return f"{100 * interval.level:.3g} % interval {low} to {high}"
