"""Speed ratios of exograv to opponents, from the medians of rows that both have."""

from collections.abc import Sequence
from typing import Any

from peers.opponents import GeneratedC, GeneratedCLanes, JaxAhead, JaxByHand, JaxTranslated, Native, Pinocchio

JAX = (JaxByHand.name, JaxAhead.name, JaxTranslated.name)
C = (GeneratedC.name, GeneratedCLanes.name)
BATCH = "batch_rnea_7_1024_f64_one_core"
BATCH_TICK = "batch_tick_aligned_7_1024_f64_one_core"
RATIOS: dict[str, tuple[str, tuple[str, ...]]] = {
    "rnea_vs_pinocchio": ("rnea_7", (Pinocchio.name,)),
    "tick_vs_c": ("tick_aligned_7", C),
    "batch_tick_vs_c": (BATCH_TICK, C),
    "tick_vs_jax": ("tick_aligned_7", JAX),
    "batch_tick_vs_jax": (BATCH_TICK, JAX),
    "batch_rnea_vs_c": (BATCH, C),
    "batch_rnea_vs_jax_vmap": (BATCH, JAX),
    "batch_rnea_vs_pinocchio": (BATCH, (Pinocchio.name,)),
}
"""Row and opponents by ratio; the fastest opponent counts. The tick is the aligned one, which JAX by hand can do.

Each row against JAX stands beside the same row against C: a call from Python costs JAX more than the computation.
"""


def ratios(rows: list[dict[str, Any]]) -> dict[str, float | None]:
    """Return the ratios of the result file; None if we or all opponents are missing."""
    return {name: ratio(rows, row, who) for name, (row, who) in RATIOS.items()}


def ratio(rows: list[dict[str, Any]], name: str, opponents: Sequence[str]) -> float | None:
    """Return the speed ratio of exograv to the fastest of these opponents in one row."""
    here = {row["implementation"]: row for row in rows if row["name"] == name}
    found = [advantage(here[Native.name], here[who]) for who in opponents if who in here and Native.name in here]
    return float(f"{min(found):.3g}") if found else None


def advantage(ours: dict[str, Any], theirs: dict[str, Any]) -> float:
    """Return the speed ratio of the first to the second: above 1 if the first is faster."""
    if ours["unit"] == "us":
        return theirs["p50"] / ours["p50"]
    return ours["p50"] / theirs["p50"]
