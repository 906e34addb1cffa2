"""Whole run: sections one after the other, and their findings in the form of the result file."""

import tempfile
from collections import defaultdict
from typing import Any

from .computer import describe_computer
from .ratios import ratios
from .section_supervisor import Findings, Progress, run_section
from .start_section import ASKED, KEEPERS

SHARES = {"single": 0.4, "batch": 0.35, "own": 0.12, "start": 0.13}
"""Share of each section in the time of a run, approximate."""


def run_bench(quick: bool, progress: Progress) -> dict[str, Any]:
    """Measure everything; `progress` takes a sentence and the share done."""
    computer, findings, past = describe_computer(), Findings(), 0.0
    for section, share in SHARES.items():
        run = _starts if section == "start" else run_section

        def show(text: str, done: float, past: float = past, share: float = share) -> None:
            progress(text, past + share * done)

        run({"section": section, "quick": quick}, findings, show)
        past += share
    return result_of(findings, computer, quick)


def result_of(findings: Findings, computer: dict[str, Any], quick: bool) -> dict[str, Any]:
    """Return the result that is written, shown and compared."""
    return {
        "machine": {**computer, "versions": findings.versions},
        "quick": quick,
        "rows": findings.rows,
        "missing": gathered(findings.missing),
        "ratios": ratios(findings.rows),
        "memory": findings.memory,
        "peaks": findings.peaks,
        "limits": findings.limits,
    }


def gathered(missing: list[dict[str, str]]) -> list[dict[str, Any]]:
    """Merge entries: one for each implementation and reason, with all rows of that reason."""
    rows: defaultdict[tuple[str, str], list[str]] = defaultdict(list)
    for entry in missing:
        found = rows[entry["implementation"], entry["reason"]]
        if entry["row"] not in found:
            found.append(entry["row"])
    return [{"implementation": who, "reason": why, "rows": names} for (who, why), names in sorted(rows.items())]


def _starts(order: dict[str, Any], findings: Findings, progress: Progress) -> None:
    """Start each engine with nothing kept on disk, then with the files that its first start has left."""
    tasks = [task for task in ASKED if not (order["quick"] and task == "tick_general_4")]
    starts = [(task, who) for task in tasks for who in ASKED[task]]
    for i, (task, who) in enumerate(starts):
        with tempfile.TemporaryDirectory(prefix="exograv_bench_") as folder:
            for kind in ("cold", "cached") if who in KEEPERS else ("cold",):
                progress(f"start of {who}", i / len(starts))
                name = f"start_{kind}_{task}"
                run_section({**order, "task": task, "implementation": who, "name": name, "folder": folder},
                            findings, lambda _text, _share: None)  # fmt: skip
        if who not in KEEPERS:
            reason = "keeps nothing on disk between two starts"
            findings.missing.append({"implementation": who, "row": f"start_cached_{task}", "reason": reason})
