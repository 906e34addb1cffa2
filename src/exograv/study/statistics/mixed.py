"""Linear mixed model of log deviation. The analysis is secondary: with few people its p-values are too small."""

import warnings
from math import exp
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from .findings import Interval, MixedFit

CAVEAT = (
    "Wald's p takes the standard deviation between people as known. With 3 against 3 people it reports a difference "
    "that does not exist in 11 to 15 % of studies instead of 5 (docs/explanation/study_statistics.md), and this "
    "software has no Kenward-Roger correction: do not quote it as a test."
)
METHODS = ("bfgs", "powell")
"""Optimisers; both are tried, and the fit with the higher likelihood is kept.

`lbfgs` is not used: in statsmodels 0.15.0 it ends at zeros and reports convergence.
"""

SINGULAR_SD = 1e-4
"""Standard deviation between people below which the estimate is on the boundary, that is 0 [log units]."""


def mixed_fit(counted: pd.DataFrame, groups: tuple[str, str]) -> MixedFit | None:
    """Fit group, window and their interaction as fixed effects, people as random intercepts, by REML.

    Args:
        counted: Columns of `people.counted_touches`.
        groups: The first is compared with the second.

    Returns:
        None with fewer than two people in a group: people and groups cannot be distinguished then.
    """
    people = [len(set(counted.loc[counted["group"] == group]["participant"])) for group in groups]
    if min(people) < 2:
        return None
    table = counted.assign(
        is_first=(counted["group"] == groups[0]).astype(float), window=counted["window"] - counted["window"].mean()
    )
    has_windows = len(set(table["window"])) > 1
    formula = "log_deviation ~ is_first" + (" * window" if has_windows else "")
    result, remarks = _fit(formula, table)
    if result is None:
        return MixedFit(formula, None, None, None, None, None, None, None, None, False, (*remarks, CAVEAT))
    estimate, error = float(result.params["is_first"]), float(result.bse["is_first"])
    margin = float(stats.norm.ppf(0.975)) * error
    freedom = sum(people) - 2
    person_sd = float(np.sqrt(max(0.0, float(np.asarray(result.cov_re)[0, 0]))))
    if person_sd < SINGULAR_SD:
        remarks.append("The fit finds no difference between people of a group, which is implausible: do not use it.")
    return MixedFit(
        formula=f"{formula} + (1 | participant)",
        ratio=exp(estimate),
        interval=Interval(exp(estimate - margin), exp(estimate + margin), 0.95, "Wald; too narrow with few people"),
        p_wald=float(2.0 * stats.norm.sf(abs(estimate / error))),
        p_between=float(2.0 * stats.t.sf(abs(estimate / error), freedom)),
        change_per_window=float(result.params["is_first:window"]) if has_windows else None,
        p_change=float(result.pvalues["is_first:window"]) if has_windows else None,
        person_sd=person_sd,
        touch_sd=float(np.sqrt(result.scale)),
        converged=bool(result.converged),
        remarks=(*remarks, CAVEAT),
    )


def _fit(formula: str, table: pd.DataFrame) -> tuple[Any | None, list[str]]:
    """Return the fit, and its warnings as sentences; None if the fit failed or has no standard error."""
    import statsmodels.formula.api as smf

    if all(len(set(own["log_deviation"])) < 2 for _, own in table.groupby("participant")):
        return None, ["All touches of each person are equal: a mixed model cannot be fitted."]
    model = smf.mixedlm(formula, table, groups=table["participant"])
    tries, remarks = [], []
    for method in METHODS:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                result: Any = model.fit(reml=True, method=[method])
            except (np.linalg.LinAlgError, ValueError) as error:
                remarks.append(f"The mixed model could not be fitted by {method}: {error}.")
                continue
        if np.isfinite(result.llf) and np.isfinite(float(result.bse["is_first"])):
            tries.append((result, list(dict.fromkeys(str(warning.message) for warning in caught))))
    if not tries:
        return None, [*remarks, "The mixed model has no standard error for the difference: it is not reported."]
    result, warned = max(tries, key=lambda one: one[0].llf)
    remarks = [f"The fit warned: {text}" for text in warned]
    if not result.converged:
        remarks.insert(0, "The mixed model did not converge: do not use its figures.")
    return result, remarks
