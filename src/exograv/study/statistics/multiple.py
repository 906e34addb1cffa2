"""Tests of many measures at once, with p-values that are corrected for the whole family."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Float

from .findings import ParticipantValue
from .relabelling import CELLS_MAX, Relabellings, generic_smallest_p, two_sided

P = Float[np.ndarray, " measure"]


@dataclass(frozen=True)
class Family:
    """Measures that are tested together."""

    table: pd.DataFrame
    """Table with one row per measure: measure, difference (of means, first minus second), p, p_holm, p_max_t."""

    p_min: float
    """Smallest p-value that is possible here."""

    left_out: tuple[str, ...]
    """Measures that were not tested, and the reason; one sentence each."""

    sentence: str
    """Description of the family and of the correction of its p-values."""


def holm(p: P) -> P:
    """Adjust p-values by Holm's method. Source: Holm 1979, Scand J Stat 6:65."""
    from statsmodels.stats.multitest import multipletests  # importing takes 0.5 s

    return np.asarray(multipletests(p, method="holm")[1])


def max_t(values: Float[np.ndarray, "measure person"], ways: Relabellings) -> P:
    """Compute step-down adjusted p-values of |t|.

    Each relabelling moves whole people, which preserves the dependence of the measures.

    Source: Westfall, Young 1993, Resampling-Based Multiple Testing, algorithm 4.1.
    """
    at_hand = _absolute_t(values, ways.in_first[:1])[:, 0]
    order = np.argsort(at_hand)
    exceeded = np.zeros(len(values))
    step = max(1, CELLS_MAX // values.size)
    for start in range(0, len(ways.in_first), step):
        t = _absolute_t(values, ways.in_first[start : start + step])
        # From the smallest to the largest: each value is compared with the largest of those that are not above it.
        largest = np.maximum.accumulate(t[order], axis=0)
        exceeded += (largest >= at_hand[order][:, None] * (1.0 - 1e-9)).sum(1)
    adjusted = np.empty(len(values))
    adjusted[order[::-1]] = np.maximum.accumulate(exceeded[::-1] / len(ways.in_first))
    return adjusted


def _absolute_t(
    values: Float[np.ndarray, "measure person"], in_first: np.ndarray
) -> Float[np.ndarray, "measure labelling"]:
    """Student's |t| of every relabelling; people who are all equal give 0."""
    centred = values - values.mean(1, keepdims=True)
    weights = in_first.T.astype(float)
    n_first, n = int(in_first[0].sum()), values.shape[1]
    between = (centred @ weights) ** 2 * (1.0 / n_first + 1.0 / (n - n_first))
    total = (centred**2).sum(1, keepdims=True)
    within = np.maximum(total - between, 1e-12 * total)
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.nan_to_num(between / within) * (n - 2))


def compare_measures(values: pd.DataFrame, ways: Relabellings, name: str) -> Family:
    """Test every measure, and all of them together.

    Args:
        values: One row per person, those of the first group first; one column per measure.
        ways: Relabellings of these people.
        name: Name of the family, for the sentence.
    """
    whole = values.loc[:, values.notna().all()]
    constant = [column for column in whole if whole[column].nunique() < 2]
    tested = whole.drop(columns=constant)
    left_out = [f"{column} is missing for at least one person." for column in values.columns.difference(whole.columns)]
    left_out += [f"{column} is the same for all people." for column in constant]
    rows = tested.to_numpy(float).T
    n_first, n = ways.n_first, len(values)
    p = two_sided(rows, ways) if len(rows) else np.zeros(0)
    table = pd.DataFrame(
        {
            "measure": tested.columns.astype("str"),
            "difference": rows[:, :n_first].mean(1) - rows[:, n_first:].mean(1),
            "p": p,
            "p_holm": holm(p),
            "p_max_t": max_t(rows, ways) if len(rows) else p,
        }
    )
    p_min = generic_smallest_p(n_first, n - n_first) if ways.is_complete else 2.0 / len(ways.in_first)
    sentence = (
        f"{name}: {len(rows)} measures, tested together. p: each measure alone. Holm: valid for any dependence. max-T "
        "(Westfall and Young): uses the dependence in these data. Corrected p-values hold for the family: the "
        f"probability of any false positive. No p-value can be below {p_min:.3g}."
    )
    return Family(table, p_min, tuple(left_out), sentence)


def family_of_sessions(
    measures: pd.DataFrame, people: tuple[ParticipantValue, ...], protocol: str, ways: Relabellings, name: str
) -> Family:
    """Test all measures of a session at once: one value per person, the mean over that person's sessions.

    Args:
        measures: Long table with participant, protocol, level, measure, value: one row per measure of a session.
        people: People of `Findings`, the first group first.
        protocol: Protocol of the sessions.
        ways: Relabellings of these people.
        name: Name of the family, for the sentence.
    """
    rows = measures.loc[(measures["level"] == "session") & (measures["protocol"] == protocol)]
    # Millimetres are pixels times a constant: the same test again would only enlarge the family.
    in_px = {str(measure).removesuffix("_px") for measure in rows["measure"] if str(measure).endswith("_px")}
    is_twin = [str(measure).endswith("_mm") and str(measure)[:-3] in in_px for measure in rows["measure"]]
    rows = rows.loc[~np.array(is_twin, bool)]
    wide = rows.pivot_table(values="value", index="participant", columns="measure", aggfunc="mean", dropna=False)
    return compare_measures(wide.reindex([person.participant for person in people]), ways, name)
