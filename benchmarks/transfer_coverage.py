"""Coverage of the intervals of transfer: docs/results/simulate_study_results.md.

    python benchmarks/transfer_coverage.py --studies 10000 --save transfer_coverage.json

The people are made up. Their first error after familiarisation is normal with mean 30 mm and a spread between people.
After training (1 − transfer) of the error remains, and each error has 5 mm of noise. Spread as a share of the error:
`alike`: a third; `apart`: two thirds; `skewed`: a third, lognormal. Studies whose E₀ cannot be told from 0 have no
transfer: their share is `untold`, and the coverage of both methods is that of the other studies.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from exograv.study.statistics.fieller import fieller

USUAL_MM, OWN_MM, TRUTH = 30.0, 5.0, 0.5
SPREADS = {"alike": 1.0 / 3.0, "apart": 2.0 / 3.0, "skewed": 1.0 / 3.0}
SIZES = (3, 4, 5, 6, 8, 12)
RESAMPLES = 1000


def people(case: str, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return errors (person,) after training and after familiarisation [mm]."""
    sd = SPREADS[case]
    if case == "skewed":
        width = np.sqrt(np.log1p(sd * sd))
        usual = USUAL_MM * np.exp(width * rng.standard_normal(n) - 0.5 * width * width)
    else:
        usual = USUAL_MM * (1.0 + sd * rng.standard_normal(n))
    trained = (1.0 - TRUTH) * usual + OWN_MM * rng.standard_normal(n)
    return trained, usual + OWN_MM * rng.standard_normal(n)


def run(case: str, n: int, studies: int, seed: int) -> dict[str, Any]:
    """Return one row of the table."""
    rng = np.random.default_rng([seed, n, list(SPREADS).index(case)])
    held, drawn_held, untold, widths = 0, 0, 0, list[float]()
    for _ in range(studies):
        trained, usual = people(case, n, rng)
        rows = rng.integers(0, n, (RESAMPLES, n))
        found = fieller(trained, usual)
        if found.interval is None or found.interval.low is None or found.interval.high is None:
            untold += 1
            continue
        held += found.interval.low <= 1.0 - TRUTH <= found.interval.high
        widths.append(found.interval.high - found.interval.low)
        low, high = np.quantile(trained[rows].mean(1) / usual[rows].mean(1), (0.025, 0.975))
        drawn_held += low <= 1.0 - TRUTH <= high
    told = max(studies - untold, 1)
    return {
        "case": case, "n": n, "studies": studies, "fieller": held / told, "bootstrap": drawn_held / told,
        "untold": untold / studies, "median_width": float(np.median(widths)) if widths else None,
    }  # fmt: skip


def table(rows: list[dict[str, Any]]) -> str:
    """Return the table in Markdown."""
    lines = ["| people | case | Fieller | bootstrap of pairs | untold | width, median |", "|---" * 6 + "|"]
    lines += [
        f"| {row['n']} | {row['case']} | {row['fieller']:.3f} | {row['bootstrap']:.3f} | {row['untold']:.3f} | "
        f"{row['median_width']:.2f} |"
        for row in rows
    ]
    return "\n".join(lines)


def main() -> None:
    """Run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--save", type=Path)
    options = parser.parse_args()
    rows = [run(case, n, options.studies, options.seed) for case in SPREADS for n in SIZES]
    if options.save:
        options.save.write_text(json.dumps(rows, indent=1) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
