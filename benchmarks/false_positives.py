"""False-positive rate of each test where the groups do not differ: docs/explanation/study_statistics.md.

    python benchmarks/false_positives.py --studies 10000 --save false_positives.json
    python benchmarks/false_positives.py --load false_positives.json
    python benchmarks/false_positives.py --coverage 10000
    python benchmarks/false_positives.py --effort --studies 10000

The people are made up, and both groups have the same middle: log deviation of a touch = person + touch, with
person ~ N(0, 0.35²). `alike`: 60 touches each. `serial`: successive touches correlate by 0.5. `unequal`: 15 to 105
touches. `heavy`: people follow Student's t with three degrees of freedom and the same spread. `spreads`: the people
of the second group spread three times as far. Under `spreads` the groups differ, but not in the middle: a test of "no
difference at all" may reject.

`--effort` tests the effort of the muscles within people, weightless against 1 g. Log effort of a window = person +
person's own difference + window, with a difference ~ N(0, 0.2²) whose mean is 0; 4 windows per condition, or 2 and 8 of
them (`unequal`); `skewed`: differences follow a log-normal law with mean 0, which the test's assumption excludes.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy import signal, stats

from exograv.study.statistics.normal import welch_interval, welch_p
from exograv.study.statistics.paired import exchanges, paired_interval, paired_p
from exograv.study.statistics.random_intercept import SufficientStatistics, fit
from exograv.study.statistics.relabelling import relabellings, two_sided

PERSON_SD, TOUCH_SD, TOUCHES = 0.35, 0.6, 60
SERIAL, HEAVY_FREEDOM, WIDER = 0.5, 3, 3.0
ALPHA = 0.05
CASES = ("alike", "serial", "unequal", "heavy", "spreads")
SIZES = (3, 4, 5, 6, 8)
DIFFERENCE_SD, WINDOW_SD, EFFORT_SIZES = 0.2, 0.3, (6, 8, 10, 14)
EFFORT_CASES = ("alike", "serial", "unequal", "heavy", "skewed")
SKEW = 0.8
"""Deviation of the logarithm of skewed differences."""

TESTS = {
    "pooled": "touches pooled, Mann–Whitney",
    "wald": "mixed model, Wald",
    "between": "mixed model, t of people − 2",
    "welch": "Welch on medians",
    "exact": "exact permutation",
}
PART = 500
"""Number of studies in memory at once."""


def touches_of(case: str, studies: int, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return log deviations (study, person, touch), and the number of touches of each person (person,)."""
    counts = np.full(2 * n, TOUCHES)
    if case == "unequal":
        counts = np.resize([15, 105, 40, 60, 90, 20, 75], 2 * n)
    shape = (studies, 2 * n, int(counts.max()))
    people = rng.standard_normal(shape[:2])
    if case == "heavy":
        people = rng.standard_t(HEAVY_FREEDOM, shape[:2]) / np.sqrt(HEAVY_FREEDOM / (HEAVY_FREEDOM - 2))
    if case == "spreads":
        people[:, n:] *= WIDER
    noise = rng.standard_normal(shape)
    if case == "serial":
        noise[..., 1:] *= np.sqrt(1.0 - SERIAL**2)
        noise = np.asarray(signal.lfilter([1.0], [1.0, -SERIAL], noise, axis=-1))
    values = PERSON_SD * people[..., None] + TOUCH_SD * noise
    return np.where(np.arange(shape[2]) < counts[:, None], values, np.nan), counts


def p_values(values: np.ndarray, counts: np.ndarray, n: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Return the p values of all studies, by test."""
    medians = np.nanmedian(values, axis=-1)
    means = np.nanmean(values, axis=-1)
    squares = np.nansum((values - means[..., None]) ** 2, axis=(1, 2))
    found = fit(SufficientStatistics(np.tile(counts.astype(float), (len(values), 1)), means, squares, n))
    z = np.abs(found.difference / found.error)
    flat = [group.reshape(len(values), -1) for group in (values[:, :n], values[:, n:])]
    pooled: Any = stats.mannwhitneyu(flat[0], flat[1], axis=1, method="asymptotic", nan_policy="omit")
    return {
        "pooled": np.asarray(pooled.pvalue),
        "wald": 2.0 * stats.norm.sf(z),
        "between": 2.0 * stats.t.sf(z, 2 * n - 2),
        "welch": welch_p(medians[:, :n], medians[:, n:]),
        "exact": two_sided(medians, relabellings(n, n, rng)),
    }


def run(case: str, n: int, studies: int, seed: int) -> dict[str, Any]:
    """Return one row of the table: rates with 95 % intervals."""
    rng = np.random.default_rng([seed, n, CASES.index(case)])
    alarms = dict.fromkeys(TESTS, 0)
    for start in range(0, studies, PART):
        values, counts = touches_of(case, min(PART, studies - start), n, rng)
        for name, p in p_values(values, counts, n, rng).items():
            alarms[name] += int((p <= ALPHA + 1e-12).sum())
    rates = {}
    for name, count in alarms.items():
        interval = stats.binomtest(count, studies).proportion_ci(0.95, "wilson")
        rates[name] = {"rate": count / studies, "ci95": [float(interval.low), float(interval.high)]}
    return {"case": case, "n": n, "studies": studies, "rates": rates}


def effort_differences(case: str, studies: int, n: int, rng: np.random.Generator) -> np.ndarray:
    """Return the differences of mean log effort (study, person)."""
    people = rng.standard_normal((studies, n))
    if case == "heavy":
        people = rng.standard_t(HEAVY_FREEDOM, (studies, n)) / np.sqrt(HEAVY_FREEDOM / (HEAVY_FREEDOM - 2))
    if case == "skewed":
        people = np.exp(SKEW * people)
        mean = np.exp(SKEW**2 / 2.0)
        people = (people - mean) / (mean * np.sqrt(np.exp(SKEW**2) - 1.0))
    first, second = (2, 8) if case == "unequal" else (4, 4)
    windows = rng.standard_normal((studies, n, first + second))
    if case == "serial":
        windows[..., 1:] *= np.sqrt(1.0 - SERIAL**2)
        windows = np.asarray(signal.lfilter([1.0], [1.0, -SERIAL], windows, axis=-1))
    means = windows[..., :first].mean(-1) - windows[..., first:].mean(-1)
    return DIFFERENCE_SD * people + WINDOW_SD * means


def effort_rates(case: str, n: int, studies: int, seed: int) -> tuple[int, int, int]:
    """Return numbers of studies: false positives, intervals that contain the truth, false positives of the t test."""
    rng = np.random.default_rng([seed, EFFORT_CASES.index(case), n])
    differences, ways = effort_differences(case, studies, n, rng), exchanges(n, rng)
    rejected = int(np.count_nonzero(paired_p(differences, ways) <= ALPHA + 1e-12))
    student: Any = stats.ttest_1samp(differences, 0.0, axis=1)
    held = 0
    for one in differences:
        interval = paired_interval(one, ways, 1.0 - ALPHA)
        held += (interval.low is None or interval.low <= 0.0) and (interval.high is None or interval.high >= 0.0)
    return rejected, held, int(np.count_nonzero(student.pvalue <= ALPHA))


def effort_table(studies: int, seed: int) -> str:
    """Return the table of the effort's test in Markdown."""
    lines = ["| people | case | exchange test | its interval holds 0 | paired t |", "|---|---|---|---|---|"]
    for case in EFFORT_CASES:
        for n in EFFORT_SIZES:
            rejected, held, by_t = effort_rates(case, n, studies, seed)
            ends = stats.binomtest(rejected, studies).proportion_ci(0.95, "wilson")
            rate = f"{rejected / studies:.3f} ({ends.low:.3f}–{ends.high:.3f})"
            lines.append(f"| {n} | {case} | {rate} | {held / studies:.3f} | {by_t / studies:.3f} |")
    return "\n".join(lines)


def coverage(n: int, spreads: tuple[float, float], studies: int, seed: int) -> float:
    """Share of studies in which Welch's interval contains the truth."""
    rng = np.random.default_rng([seed, n])
    held = 0
    for first, second in rng.normal(size=(studies, 2, n)):
        _, interval = welch_interval(spreads[0] * first, spreads[1] * second)
        held += interval is not None and (interval.low or 0.0) <= 0.0 <= (interval.high or 0.0)
    return held / studies


def table(rows: list[dict[str, Any]]) -> str:
    """Return the table in Markdown."""
    lines = ["| people | case | " + " | ".join(TESTS.values()) + " |", "|---" * (2 + len(TESTS)) + "|"]
    for row in rows:
        cells = (f"{rate['rate']:.3f} ({rate['ci95'][0]:.3f}–{rate['ci95'][1]:.3f})" for rate in row["rates"].values())
        lines.append(f"| {row['n']} v {row['n']} | {row['case']} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Run or load, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=10_000)
    parser.add_argument("--cases", default=",".join(CASES))
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--coverage", type=int, help="simulate Welch's interval this many times instead")
    parser.add_argument("--effort", action="store_true", help="test the effort of the muscles instead")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path)
    options = parser.parse_args()
    if options.coverage is not None:
        for spreads in ((1.0, 1.0), (1.0, WIDER)):
            shares = ", ".join(f"{n} v {n}: {coverage(n, spreads, options.coverage, options.seed):.3f}" for n in SIZES)
            print(f"spreads {spreads[0]:g} and {spreads[1]:g}: {shares}")
        return
    if options.effort:
        print(effort_table(options.studies, options.seed))
        return
    if options.load:
        rows = json.loads(options.load.read_text())
    else:
        sizes = [int(size) for size in options.sizes.split(",")]
        rows = [run(case, n, options.studies, options.seed) for case in options.cases.split(",") for n in sizes]
    if options.save:
        options.save.write_text(json.dumps(rows, indent=1) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
