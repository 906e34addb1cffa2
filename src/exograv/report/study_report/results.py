"""Results in tables: each person by itself, and every measure by group. Described, not tested."""

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
"""Of which a median over people says nothing, or which stand elsewhere."""


def people_table(data: StudyData) -> Table:
    """Touches and deviation of each person, of what is compared."""
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
    heads = ("participant", "group", "touches", "median [px]", "half of them within [px]", "median [mm]")
    return Table(heads, sorted(lines, key=lambda row: (row[1], row[0])))


def measures_table(data: StudyData) -> Table:
    """A row a measure of what is compared: median over people, and the smallest and largest of a person."""
    lines = []
    of_sessions = {measure.name for measure in MEASURES if measure.level == "session"}
    for measure in MEASURES:
        # While groups are sealed, what the machine did would tell who is in which.
        is_telling = measure.name in ("carried_share", "motor_torque_rms_Nm") and data.is_sealed
        is_twice = measure.level != "session" and measure.name in of_sessions
        if measure.name in NOT_SHOWN or is_telling or is_twice:
            continue
        for protocol, values in _by_person(data, measure).items():
            cells = [_summary(column(rows(values, values["group"] == group), "value")) for group in data.groups]
            lines.append((with_unit(measure, protocol), *cells, measure.meaning))
    return Table(("measure", *(label(group) for group in data.groups), "meaning"), lines)


def _by_person(data: StudyData, measure: Measure) -> dict[str, pd.DataFrame]:
    """One value a person, the median over what is compared; of a measure over sessions by protocol."""
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
    """Three digits that count, with a minus sign."""
    text = f"{value:.3g}" if 1e-3 <= abs(value) < 1e4 or value == 0.0 else f"{value:.2e}"
    return f"{float(text):g}".replace("-", "−")


def with_unit(measure: Measure, of: str = "") -> str:
    """A measure's name in words, of what, and its unit."""
    return f"{in_words(measure.name)}{of}" + ("" if measure.unit == "-" else f" [{measure.unit}]")


def in_words(name: str) -> str:
    """A measure's name without its unit."""
    units = ("_px", "_mm", "_s", "_m", "_rad", "_deg", "_Nm", "_m_per_s", "_rad_per_s")
    for unit in sorted(units, key=len, reverse=True):
        name = name.removesuffix(unit) if name.endswith(unit) else name
    return name.replace("_", " ")


def family_of(data: StudyData, found: StudyFindings) -> Family | None:
    """All measures of the sessions that are compared, tested together; None with fewer than two people in a group."""
    first, second = (sum(person.group == group for person in found.people) for group in found.groups)
    if min(first, second) < 2:
        return None
    ways = relabellings(first, second, np.random.default_rng(0))
    # A difference of directions says nothing: they go round.
    straight = rows(data.measures, ~data.measures["measure"].isin(list(NOT_SHOWN)))
    return family_of_sessions(straight, found.people, found.protocol, ways, f"Measures of a {found.protocol}")


def family_rows(family: Family) -> list[tuple[str, ...]]:
    """Smallest p first."""
    lines = keys(family.table, ["p", "measure", "difference", "p_holm", "p_max_t"])
    return [
        (with_unit(measure_of(name, "session")), *(number(value) for value in (difference, p, holm, max_t)))
        for p, name, difference, holm, max_t in sorted(lines)
    ]


def test_rows(found: StudyFindings) -> list[tuple[str, ...]]:
    """Primary first."""
    return [(one.name, one.text, one.sentence) for one in (found.primary, *found.other_tests)]


def effect_rows(found: StudyFindings) -> list[tuple[str, ...]]:
    """Primary first."""
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
    """`95 % interval 0.3 to 0.6`."""
    low = "without bound" if interval.low is None else number(interval.low)
    high = "without bound" if interval.high is None else number(interval.high)
    return f"{100 * interval.level:.3g} % interval {low} to {high}"
