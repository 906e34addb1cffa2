"""Comparison of `exograv run support-level` on weak virtual wearers with the known answer: docs/howto/support_level.md.

    python benchmarks/support_level.py --seeds 1000-1009 --save support_level.json
    python benchmarks/support_level.py --load support_level.json

Each seed is another body, strength and synergy. The known answer comes from brute force: every target at all supports
near the answer, on the same machine and person, with other noise. Results depend only on the seeds, times also on
the computer. Wearers that are already in the file are not flown again.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from seeds import seed_range

STRENGTHS, SYNERGY_MAX = (0.04, 0.12), 0.4
"""Ranges of a wearer's drawn strength and synergy; every second wearer has no synergy."""

KNOWN_SEED = 500_000
"""Offset to the wearer's seed: the known answer has its own noise."""


def quiet(_text: str, _share: float) -> None:
    """Ignore progress."""


def run(rig: str, level: int, seed: int, repeats: int) -> dict[str, Any]:
    """Run the search and the brute force for one wearer; return the figures.

    Raises:
        ExogravError: The machine or the wearer was refused, or the guard stopped the run.
    """
    from exograv.laboratory.support_level.weak_participant import prepare_weak_participant
    from exograv.procedures.rehabilitation.support_level.flight import SupportFlight
    from exograv.procedures.rehabilitation.support_level.options import SupportOptions
    from exograv.procedures.rehabilitation.support_level.tested_support import search_flight
    from known_support_level import fly_answer, static_answer

    random = np.random.default_rng([seed, 83])
    strength, synergy = round(float(random.uniform(*STRENGTHS)), 3), round(float(random.uniform(0.1, SYNERGY_MAX)), 2)
    synergy = synergy if seed % 2 else 0.0
    times = [time.process_time()]
    one = prepare_weak_participant(
        SupportOptions(rig=rig, level=level, seed=seed, strength=strength, synergy=synergy), quiet
    )
    times.append(time.process_time())
    machine, person = one.seated(seed)
    flight = SupportFlight(machine, person, one.side)
    needed, attempts = search_flight(flight, seed, quiet)
    times.append(time.process_time())
    other, tried = one.flight(seed + KNOWN_SEED), list[tuple[int, float, bool]]()

    def tries(target: int, support: float) -> bool:
        tried.append((target, round(support, 3), other.attempt(target, support).reached))
        return tried[-1][2]

    flown = fly_answer(tries, len(flight.places), repeats, quiet)
    times.append(time.process_time())
    middle, low, high = needed.ci
    known_low, known_high = flown.interval()
    return {
        "rig": rig, "level": level, "seed": seed, "repeats": repeats, "strength": strength, "synergy": synergy,
        "found": middle, "low": low, "high": high, "beyond": needed.beyond, "attempts": len(attempts),
        "minutes": flight.seconds / 60.0, "rescues": flight.rescues, "clipped_share": machine.clipped_share,
        "known": flown.needed(), "known_low": known_low, "known_high": known_high,
        "static": static_answer(one, list(flight.places)),
        "tried": [(a.target, round(a.support, 3), a.reached) for a in attempts], "known_tried": tried,
        "known_rescues": other.rescues, "core_s": np.diff(times).round(1).tolist(),
    }  # fmt: skip


def covers(row: dict[str, Any]) -> bool:
    """Return True if the stated interval holds the known answer, or reaches full support where none is enough."""
    if row["known"] is None:
        return row["high"] >= 1.0
    return row["low"] <= row["known"] <= row["high"]


def percent(value: float | None) -> str:
    """Return a share of the weight in percent."""
    return "more than all" if value is None else f"{100 * value:.0f}"


def show(rows: list[dict[str, Any]]) -> None:
    """Print the table in Markdown."""
    print(
        "| seed | strength | synergy | found % (95 %) | known % (95 %) | holds it | statics % | attempts | minutes | "
        "sank | limited ticks |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        found = None if row["beyond"] > 0.5 else row["found"]
        print(
            f"| {row['seed']} | {row['strength']:g} | {row['synergy']:g} | {percent(found)} "
            f"({percent(row['low'])}–{percent(row['high'])}) | {percent(row['known'])} "
            f"({percent(row['known_low'])}–{percent(row['known_high'])}) | {'yes' if covers(row) else 'no'} | "
            f"{percent(row['static'])} | {row['attempts']} | {row['minutes']:.1f} | {row['rescues']} | "
            f"{100 * row['clipped_share']:.2f} % |"
        )
    off = [abs(row["found"] - row["known"]) for row in rows if row["known"] is not None]
    core = np.sum([row["core_s"] for row in rows], axis=0) / 60.0
    print(
        f"\n{sum(map(covers, rows))} of {len(rows)} intervals hold the known answer; found and known are "
        f"{100 * sum(off) / max(len(off), 1):.1f} points apart on average, {100 * max(off, default=0.0):.1f} at most. "
        f"{core.sum():.0f} core-minutes: {core[0]:.0f} to prepare, {core[1]:.0f} search, {core[2]:.0f} brute force.",
        flush=True,
    )


def main() -> None:
    """Run or load, then print; results are saved wearer by wearer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="recupera_like_qdd")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="1000-1009")
    parser.add_argument("--repeats", type=int, default=1, help="attempts per target and support, known answer")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path)
    options = parser.parse_args()
    file: Path | None = options.load or options.save
    rows: list[dict[str, Any]] = json.loads(file.read_text()) if file is not None and file.exists() else []
    if not options.load:
        for seed in seed_range(options.seeds):
            asked = {"rig": options.rig, "level": options.level, "seed": seed, "repeats": options.repeats}
            if any(asked.items() <= row.items() for row in rows):
                continue
            rows.append(run(**asked))
            show(rows)
            if options.save:
                options.save.write_text(json.dumps(rows, indent=1))
    show(rows)


if __name__ == "__main__":
    main()
