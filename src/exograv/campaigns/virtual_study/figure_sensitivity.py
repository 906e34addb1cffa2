"""Figure of transfer against each unverified constant, the one with the largest effect on top."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from exograv.laboratory.participant.habits import swept
from exograv.report.study_figures.groups import WIDTH_2
from exograv.report.style.colours import BLUE, GREY, INK, ORANGE
from exograv.report.style.figure_style import mark_simulated, name_rows

from .small_study import SIZE

TEXT = (
    "Transfer with one constant of the virtual participant at the low end (orange, hatched) or the high end (blue) of "
    "its plausible range, all others at their usual values. Thin lines are 95 % intervals over people. The vertical "
    "line is transfer with all usual values. One constant changes at a time, so joint effects are not shown. The "
    "machine is "
    f"the ideal one, which knows itself and the arm; {SIZE}."
)


@dataclass(frozen=True)
class SensitivityPoint:
    """Transfer with one constant at one value."""

    name: str
    value: float | None
    """Value of the constant; None if all have their usual values."""

    transfer: float | None
    ci95: tuple[float, float] | None
    """Confidence interval of 95 %; None if it cannot be determined."""


def draw(rows: Sequence[SensitivityPoint], usual: float | None) -> Figure | None:
    """Draw one bar per constant and end; `usual` is transfer with all usual values. None without anything to show."""
    if not rows or usual is None:
        return None
    ends, lowest = spans(rows, usual), {one.name: one.low for one in swept()}
    figure = Figure(figsize=(WIDTH_2, 0.8 + 0.3 * len(ends)), layout="constrained")
    ax = figure.subplots()
    for at, own in enumerate(ends):
        for k, row in enumerate(own):
            if row.transfer is None:
                continue
            # A constant whose usual value is an end has only the other end.
            is_low = k == 0 and (len(own) > 1 or row.value == lowest.get(row.name))
            y = at - 0.19 if is_low else at + 0.19
            ax.barh(y, row.transfer - usual, 0.36, left=usual, color=ORANGE if is_low else BLUE, alpha=0.75,
                    hatch="///" if is_low else "", edgecolor=INK, linewidth=0.5)  # fmt: skip
            if row.ci95 is not None:
                ax.plot(row.ci95, [y, y], color=INK, linewidth=0.8)
    ax.axvline(usual, color=INK, linewidth=1.0)
    ax.axvline(0.0, color=GREY, linewidth=0.8, linestyle=(0, (3, 2)))
    name_rows(ax, [f"{own[0].name}: {' / '.join(f'{row.value or 0.0:g}' for row in own)}" for own in ends])
    ax.set_xlabel("transfer [-]")
    mark_simulated(figure)
    return figure


def spans(rows: Sequence[SensitivityPoint], usual: float) -> list[tuple[SensitivityPoint, ...]]:
    """Rows of each constant from low to high. The constant that moves transfer most from `usual` comes first."""
    by_name = dict[str, list[SensitivityPoint]]()
    for row in rows:
        by_name.setdefault(row.name, []).append(row)

    def width(own: tuple[SensitivityPoint, ...]) -> float:
        told = [usual, *(row.transfer for row in own if row.transfer is not None)]
        return max(told) - min(told)

    return sorted(
        (tuple(sorted(own, key=lambda row: row.value or 0.0)) for own in by_name.values()), key=width, reverse=True
    )
