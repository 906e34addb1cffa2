"""`exograv support-level` on weak virtual wearers against the known answer: the table of docs/support_level.md.

    python benchmarks/support_level.py --seeds 1000-1009 --save support_level.json
    python benchmarks/support_level.py --load support_level.json

Strengths are spread over the wearers, every second one has a synergy. Known is what brute force finds: every target at
supports of every 5 %, on the same machine and person, with noise of its own. Results come from seeds and are the same
on every computer; the times are not.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

STRENGTHS = (0.07, 0.09, 0.11, 0.14, 0.18)
SYNERGY = 0.3
KNOWN_SEED = 500_000
"""Added to the wearer's: the known answer has noise of its own."""


def run(rig: str, level: int, seed: int, number: int, repeats: int) -> dict[str, Any]:
    """Of one wearer."""
    from exograv.session.support_level.known_answer import fly_answer, static_answer
    from exograv.session.support_level.options import SupportOptions
    from exograv.session.support_level.ready import subject
    from exograv.session.support_level.run import search_flight

    strength = STRENGTHS[number % len(STRENGTHS)]
    synergy = SYNERGY if number % 2 else 0.0
    begin = time.perf_counter()
    options = SupportOptions(rig=rig, level=level, seed=seed, strength=strength, synergy=synergy)
    one = subject(options, lambda _text, _share: None)
    flight = one.flight(seed)
    needed, attempts = search_flight(flight, seed, lambda _text, _share: None)
    wall_s = time.perf_counter() - begin
    static = static_answer(one, list(flight.places))
    flown = fly_answer(one, 1.0 if static is None else static, repeats, seed + KNOWN_SEED, lambda _text, _share: None)
    middle, low, high = needed.ci
    known, (known_low, known_high) = flown.needed(), flown.interval(seed)
    return {
        "rig": rig, "seed": seed, "strength": strength, "synergy": synergy,
        "found": middle, "low": low, "high": high, "beyond": needed.beyond, "attempts": len(attempts),
        "rescues": flight.rescues, "known": known, "known_low": known_low, "known_high": known_high, "static": static,
        "known_share": flown.reached.mean(axis=(1, 2)).tolist(), "known_supports": flown.supports.tolist(),
        "wall_s": wall_s, "simulated_s": flight.seconds,
    }  # fmt: skip


def covers(row: dict[str, Any]) -> bool:
    """Whether the stated interval holds the known answer; where none is enough, whether it says so."""
    if row["known"] is None:
        return row["high"] >= 1.0
    return row["low"] <= row["known"] <= row["high"]


def percent(value: float | None) -> str:
    """Of the weight."""
    return "more than all" if value is None else f"{100 * value:.0f}"


def show(rows: list[dict[str, Any]]) -> None:
    """In Markdown."""
    print(
        "| machine | seed | strength | synergy | found % | 95 % interval | known % (its 95 %) | static % | holds it |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        found = None if row["beyond"] > 0.5 else row["found"]
        print(
            f"| {row['rig']} | {row['seed']} | {row['strength']:g} | {row['synergy']:g} | {percent(found)} | "
            f"{percent(row['low'])}–{percent(row['high'])} | {percent(row['known'])} "
            f"({percent(row['known_low'])}–{percent(row['known_high'])}) | {percent(row['static'])} | "
            f"{'yes' if covers(row) else 'no'} |"
        )
    off = [abs(row["found"] - row["known"]) for row in rows if row["known"] is not None]
    print(
        f"\n{sum(map(covers, rows))} of {len(rows)} intervals hold the known answer; found and known are "
        f"{100 * sum(off) / max(len(off), 1):.1f} points apart on average, {100 * max(off, default=0.0):.1f} at most; "
        f"{max(row['attempts'] for row in rows)} attempts and {max(row['wall_s'] for row in rows):.0f} s at most."
    )


def main() -> None:
    """Run or load, then show; what is done is saved wearer by wearer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", default="recupera_like_qdd")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="1000-1009")
    parser.add_argument("--repeats", type=int, default=1, help="of each target at each support, for the known answer")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path)
    options = parser.parse_args()
    rows: list[dict[str, Any]] = json.loads(options.load.read_text()) if options.load else []
    if not options.load:
        first, _, last = options.seeds.partition("-")
        for rig in options.rigs.split(","):
            for number, seed in enumerate(range(int(first), int(last or first) + 1)):
                rows.append(run(rig, options.level, seed, number, options.repeats))
                print(rows[-1], flush=True)
                if options.save:
                    options.save.write_text(json.dumps(rows, indent=1))
    show(rows)


if __name__ == "__main__":
    main()
