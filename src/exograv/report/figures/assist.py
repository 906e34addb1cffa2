"""How support followed a person: what was carried, within its bounds, and what was reached with it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from exograv.report.style.figure_style import BLUE, GREY, ORANGE, RED, mark_simulated


def draw_assist(blocks: Sequence[dict[str, Any]], word: Callable[[str], str]) -> Figure:
    """Above support, below the share of targets reached, block by block over all sessions.

    Args:
        blocks: `session`, `support`, `low` and `high` [%], `share` [-] and `sank` of each.
        word: What an axis is called in the page's language.
    """
    figure = Figure(figsize=(9.6, 4.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1.0])
    edges = np.arange(len(blocks) + 1) + 0.5
    low, high, support = (np.array([one[name] for one in blocks]) for name in ("low", "high", "support"))
    above.fill_between(edges, [*low, low[-1]], [*high, high[-1]], step="post", color=BLUE, alpha=0.1, lw=0)
    above.stairs(support, edges, baseline=None, color=BLUE, lw=2.2)
    sank = np.flatnonzero([one["sank"] for one in blocks])
    above.plot(sank + 1, support[sank], "x", color=RED, ms=9, mew=2)
    below.bar(np.arange(len(blocks)) + 1, [100 * one["share"] for one in blocks], width=0.7, color=ORANGE)
    for k, one in enumerate(blocks):
        if k == 0 or one["session"] != blocks[k - 1]["session"]:
            for ax in (above, below):
                ax.axvline(k + 0.5, color=GREY, ls=":", lw=1.2)
            above.annotate(f"{word('session')} {one['session']}", (k + 0.6, 101.0), fontsize=8, color=GREY)
    above.set_ylim(-2, 109)
    above.set_ylabel(word("carried"))
    below.set_ylim(0, 105)
    below.set_ylabel(word("reached"))
    below.set_xlabel(word("block"))
    below.set_xticks(np.arange(len(blocks)) + 1)
    mark_simulated(figure)
    return figure
