"""Figure of a next study: power over the number of people, and width of its interval."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exograv.report.style.colours import BLUE, GREEN, GREY, ORANGE
from exograv.report.style.figure_style import legend, mark_simulated
from exograv.study.power.curve import TARGETS, PowerResult

from .groups import WIDTH_2


def draw(result: PowerResult, is_simulated: bool) -> Figure:
    """Draw the share of studies that find the difference, and their precision; `result` is that of `power_study`."""
    figure = Figure((WIDTH_2, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw_power(left, result)
    legend(figure, [left], "lower left", 3)
    n = [row.n for row in result.curve]
    right.plot(n, [row.width_factor for row in result.curve], color=BLUE, marker="o", markersize=3)
    right.set(title="Precision", xlabel="people per group", ylabel="95 % interval: times, divided by", yscale="log")
    ticks = [1.2, 1.5, 2.0, 3.0, 5.0, 10.0]
    right.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    right.minorticks_off()
    widths = [row.width_factor for row in result.curve]
    right.set_ylim(min(1.1, 0.99 * min(widths)), max(2.0, 1.1 * max(widths)))
    for axes in (left, right):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if is_simulated:
        mark_simulated(figure)
    return figure


def _draw_power(axes: Axes, result: PowerResult) -> None:
    curve = result.curve
    n = [row.n for row in curve]
    lines = {
        "power": ("exact test", BLUE, "-"),
        "welch_power": ("Welch, if logarithms are normal", ORANGE, "--"),
        "assurance": ("assurance: over the pilot's uncertainty", GREEN, "-."),
    }
    for key, (label, colour, style) in lines.items():
        if getattr(curve[0], key) is not None:
            axes.plot(n, [getattr(row, key) for row in curve], label=label, color=colour, linestyle=style)
    for target in TARGETS:
        axes.axhline(target, color=GREY, linewidth=0.8, linestyle=":")
    ratio = result.assumptions.ratio
    axes.set(title=f"A ratio of {ratio:.2g} is found", xlabel="people per group", ylabel="share of studies")
    axes.set_ylim(0.0, 1.02)


def explain(planned: PowerResult) -> str:
    """Explain the figure, with the conclusions."""
    return (
        f"For a ratio of {planned.assumptions.ratio:.2g}, which is stated and not taken from this study, and for "
        f"people who differ as much as in this study. {' '.join(planned.sentences)}"
    )
