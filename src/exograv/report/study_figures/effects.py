"""Figure of the difference between the groups: every effect that is a ratio, with its interval, the primary on top."""

import numpy as np
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREY, INK
from exograv.report.style.figure_style import name_rows, plain_ticks
from exograv.study.measures.study_data import StudyData
from exograv.study.statistics.findings import Interval, StudyFindings

from .groups import WIDTH_2, marked

Line = tuple[str, float, Interval | None]


def draw(data: StudyData, findings: StudyFindings) -> Figure | None:
    """Draw one line per effect."""
    lines = ratios(findings)
    if not lines:
        return None
    figure = Figure(figsize=(WIDTH_2, 0.9 + 0.33 * len(lines)), layout="constrained")
    ax = figure.subplots()
    ends = [value for _, value, _ in lines]
    for _, _, interval in lines:
        ends += [end for end in ((interval.low, interval.high) if interval else ()) if end is not None and end > 0.0]
    low, high = min(*ends, 1.0) / 1.3, max(*ends, 1.0) * 1.3
    for row, (_, value, interval) in enumerate(lines):
        colour = BLUE if row == 0 else INK
        if interval is not None:
            # An unbounded end leaves the frame.
            first, last = interval.low or low / 2.0, interval.high or 2.0 * high
            ax.plot([first, last], [row, row], color=colour, linewidth=2.0 if row == 0 else 1.2)
        ax.plot([value], [row], "D" if row == 0 else "o", color=colour, markersize=6 if row == 0 else 4)
    ax.axvline(1.0, color=GREY, linewidth=0.9)
    ax.set(xscale="log", xlim=(low, high))
    plain_ticks(ax.xaxis, np.array([low, high]))
    name_rows(ax, [name for name, _, _ in lines])
    first, second = findings.groups
    ax.set_xlabel(f"deviation of {first} over that of {second}")
    return marked(figure, data)


def ratios(findings: StudyFindings) -> list[Line]:
    """Return the effects that are ratios of deviation, from all models."""
    effects = (findings.effect, *findings.other_effects)
    lines: list[Line] = [
        (effect.name + _level(effect.interval), effect.value, effect.interval)
        for effect in effects
        if effect.value is not None and effect.value > 0.0 and "ratio" in effect.name
    ]
    if findings.mixed is not None and findings.mixed.ratio is not None:
        lines.append(("mixed model (secondary)", findings.mixed.ratio, findings.mixed.interval))
    if findings.bayes is not None and findings.bayes.posteriors:
        quoted = findings.bayes.posteriors[0]
        lines.append(("hierarchical model (optional)", quoted.ratio, quoted.interval))
    return lines


def _level(interval: Interval | None) -> str:
    """Return the level of an interval below 95 %, the highest that so few people allow."""
    return "" if interval is None or interval.level >= 0.95 else f", {100.0 * interval.level:.0f} %"


def explain(findings: StudyFindings) -> str:
    """Return the caption that explains how to read the figure."""
    first, _ = findings.groups
    return (
        f"Left of 1 the {first} deviate less. The uppermost line is the primary comparison of the study; the others "
        "rest on more assumptions and do not replace it. Bars are 95 % intervals unless a lower level is stated, "
        "because so few people do not allow 95 %. A bar that leaves the frame is unbounded there."
    )
