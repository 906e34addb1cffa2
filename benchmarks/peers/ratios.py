"""Speed ratios of exograv to opponents, from the medians of rows that both have."""

from collections.abc import Sequence
from typing import Any

from peers.opponents import JaxByHand, JaxTranslated, Native, Pinocchio

JAX = (JaxByHand.name, JaxTranslated.name)
BATCH = "batch_rnea_7_1024_f64_one_core"
RATIOS: dict[str, tuple[str, tuple[str, ...]]] = {
    "rnea_vs_pinocchio": ("rnea_7", (Pinocchio.name,)),
    "tick_vs_jax": ("tick_aligned_7", JAX),
    "batch_rnea_vs_jax_vmap": (BATCH, JAX),
    "batch_rnea_vs_pinocchio": (BATCH, (Pinocchio.name,)),
}
"""Row and opponents by ratio; the fastest opponent counts. The tick is the aligned one, which JAX by hand can do."""


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
