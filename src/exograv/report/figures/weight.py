"""Figure of an unannounced weight in the hand: estimate, interval and true weight."""

from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.report.style.colours import BLUE, GREEN
from exograv.report.style.figure_style import legend


def draw(recording: Recording) -> Figure | None:
    """Draw the estimate with its interval, and the true weight if it is known."""
    weight = recording.last("/result").get("known_weight") or {}
    if weight.get("estimated_kg") is None:
        return None
    estimate, (low, high) = weight["estimated_kg"], weight.get("ci95_kg") or [weight["estimated_kg"]] * 2
    figure = Figure(figsize=(9.6, 1.5), layout="constrained")
    ax = figure.subplots()
    ax.plot([low, high], [0, 0], color=BLUE, lw=9, alpha=0.3, solid_capstyle="butt", label="95 % interval")
    ax.plot([estimate], [0], "o", color=BLUE, ms=8, label=f"estimate {estimate:.3f} kg")
    truth = weight.get("true_kg")
    if truth is not None:
        ax.axvline(truth, color=GREEN, lw=1.6, label=f"true {truth:.3f} kg")
    ends = [low, high, estimate, *([] if truth is None else [truth])]
    margin = max(0.05, 0.4 * (max(ends) - min(ends)))
    ax.set(xlim=(max(0.0, min(ends) - margin), max(ends) + margin), ylim=(-1, 1))
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.set_xlabel("weight in the hand [kg]")
    legend(figure, [ax], "upper center", 3)
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    weight = recording.last("/result")["known_weight"]
    truth = weight.get("true_kg")
    error = f" The error is {1000 * abs(weight['estimated_kg'] - truth):.0f} g." if truth is not None else ""
    return (
        "The same motion with and without a weight in the hand shows the weight, which the machine was not given. The "
        f"dot is the estimate, the band holds the true weight with 95 % certainty.{error} From then on it is carried "
        "too."
    )
