"""Figure of transfer against left over, and against friction."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.study_figures.groups import WIDTH_2
from exograv.report.style.colours import BLUE, GREY, INK, JOINT_COLOURS
from exograv.report.style.figure_style import blank, legend, mark_simulated, plain_ticks

from .curve import TransferCurve
from .outcome import TransferOutcome

MARKERS = "osD^vPX<>*"
TEXT = (
    "Share of the first error that training took away. Small marks: one person after one training. Large marks: a "
    "condition's mean over people, at the mean of its machines. Filled: conditions of one kind, which differ only by "
    "the quantity on the axis. The line is the curve nearest to these means that never rises. Its band, from five "
    "people on, holds 95 % of such curves when people are resampled with all their points. The line cannot rise; the "
    "slope tells whether transfer falls at all. Empty: other conditions, which differ by more and are not part of the "
    "line."
)


def draw(told: TransferOutcome) -> Figure | None:
    """Draw two panels; None where neither has points."""
    panels = [
        (told.by_left_over, "left over, worst shoulder axis [N·m]", True),
        (told.by_friction, "friction, mean over joints [N·m]", False),
    ]
    shown = [one for one in panels if one[0].points]
    if not shown:
        return None
    figure = Figure(figsize=(WIDTH_2, 3.2), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, 2, sharey=True))
    blank(axes[len(shown) :])
    names = list(dict.fromkeys(point.condition for one, _, _ in shown for point in one.points))
    for ax, (of, words, is_log) in zip(axes, shown, strict=False):
        _panel(ax, of, names)
        ax.set_xlabel(words)
        if is_log:
            ax.set_xscale("log")
            plain_ticks(ax.xaxis, np.array(ax.get_xlim()))
    axes[0].set_ylabel("transfer [-]")
    legend(figure, axes, "lower center", 4, fontsize=6.5)
    mark_simulated(figure)
    return figure


def _panel(ax: Axes, of: TransferCurve, names: Sequence[str]) -> None:
    curve = of.curve
    if curve is not None:
        if curve.low is not None and curve.high is not None:
            ax.fill_between(curve.x_Nm, curve.low, curve.high, color=GREY, alpha=0.25, linewidth=0)
        ax.plot(curve.x_Nm, curve.transfer, color=INK, linewidth=1.4)
    for level in (0.0, 1.0):
        ax.axhline(level, color=INK, linewidth=0.7, linestyle=(0, (3, 2)))
    for k, name in enumerate(names):
        own = [point for point in of.points if point.condition == name]
        if not own:
            continue
        marker, colour = MARKERS[k % len(MARKERS)], (*JOINT_COLOURS, BLUE)[k % len(JOINT_COLOURS)]
        x, y = (np.array([getattr(point, key) for point in own]) for key in ("x_Nm", "taken_away"))
        ax.plot(x, y, marker, color=colour, markersize=2.5, alpha=0.6, markeredgewidth=0)
        is_on = bool(own[0].is_on_curve)
        ax.plot([x.mean()], [y.mean()], marker, color=colour, markersize=6,
                markerfacecolor=colour if is_on else "white", markeredgecolor=INK if is_on else colour,
                markeredgewidth=0.6 if is_on else 1.2, linestyle="none", label=name)  # fmt: skip
