"""Figure of a training with adaptive support: support within its bounds, and share of reached targets."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREY, ORANGE, RED
from exograv.report.style.figure_style import mark_simulated


@dataclass(frozen=True)
class SupportBlock:
    """Attempts with the same support."""

    session: int
    support: float
    """Share of the arm's weight that was carried [%]."""

    share: float
    """Share of reached targets [-]."""

    sank: bool
    low: float
    high: float
    """Bounds of the support [%]."""


def draw_assist(blocks: Sequence[SupportBlock], word: Callable[[str], str], is_simulated: bool) -> Figure:
    """Draw support above, and the share of reached targets below, block by block over all sessions.

    Args:
        blocks: Blocks of all sessions, in their order.
        word: Gives the name of an axis in the page's language.
        is_simulated: True to mark the figure as simulated.
    """
    figure = Figure(figsize=(9.6, 4.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1.0])
    edges, numbers = np.arange(len(blocks) + 1) + 0.5, np.arange(len(blocks)) + 1
    low, high, support = np.array([(one.low, one.high, one.support) for one in blocks]).T
    above.fill_between(edges, [*low, low[-1]], [*high, high[-1]], step="post", color=BLUE, alpha=0.1, lw=0)
    above.stairs(support, edges, baseline=None, color=BLUE, lw=2.2)
    sank = np.flatnonzero([one.sank for one in blocks])
    above.plot(sank + 1, support[sank], "x", color=RED, ms=9, mew=2)
    below.bar(numbers, [100 * one.share for one in blocks], width=0.7, color=ORANGE)
    for k, one in enumerate(blocks):
        if k == 0 or one.session != blocks[k - 1].session:
            for ax in (above, below):
                ax.axvline(k + 0.5, color=GREY, ls=":", lw=1.2)
            above.annotate(f"{word('session')} {one.session}", (k + 0.6, 101.0), fontsize=8, color=GREY)
    above.set(ylim=(-2, 109), ylabel=word("carried"))
    below.set(ylim=(0, 105), ylabel=word("reached"), xlabel=word("block"), xticks=numbers)
    return mark_simulated(figure, is_simulated)
