"""Accuracy of a repeated taught path and of a mirrored arm, and the guard's actions: docs/howto/guided.md.

    python benchmarks/guided.py --seeds 1000-1004 --save guided.json
    python benchmarks/guided.py --load guided.json

One row per seed and case: a relaxed person, one who pauses, one who holds on, one who asks for release; and a mirror
with a relaxed person and with one who holds the led arm. Results depend only on the seeds.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

CASES = ("relaxed", "pauses", "overrules", "lets-go")
MIRROR_CASES = ("relaxed", "overrules")


def quiet(_text: str, _share: float) -> None:
    """Ignore progress."""


def run(seed: int, level: int, folder: Path) -> list[dict[str, Any]]:
    """Run all cases of one seed."""
    from exograv.errors import ExogravError
    from exograv.laboratory.guided.guided_command import run_repeat, run_teach
    from exograv.laboratory.guided.mirror_command import run_mirror
    from exograv.laboratory.preparation import prepare
    from exograv.laboratory.virtual_laboratory import VirtualLaboratory
    from exograv.loop.pilot import Progress
    from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
    from exograv.procedures.rehabilitation.guided.options import GuidedOptions, MirrorOptions, RepeatOptions
    from exograv.results import json_value

    path, known = folder / f"{seed}.toml", dict[str, ControllerKnowledge]()

    def once(laboratory: VirtualLaboratory, seed: int, progress: Progress) -> ControllerKnowledge:
        name = laboratory.description.name
        if name not in known:
            known[name] = prepare(laboratory, seed, progress)
        return known[name]

    def options_of(kind: type, **more: Any) -> Any:
        return kind(level=level, seed=seed, **more)

    acts = [("teach", "relaxed", lambda: run_teach(options_of(GuidedOptions), path, "", folder, quiet, once))]
    for case in CASES:
        options = options_of(RepeatOptions, person=case)
        acts.append(("repeat", case, lambda options=options: run_repeat(options, path, None, folder, quiet, once)))
    for case in MIRROR_CASES:
        options = options_of(MirrorOptions, person=case)
        acts.append(("mirror", case, lambda options=options: run_mirror(options, folder, quiet, once)))
    rows = []
    for what, case, act in acts:
        try:
            result: dict[str, Any] = json_value(act())
        except ExogravError as error:
            result = {"refused": str(error)}
        rows.append({"what": what, "case": case, "seed": seed, **result})
        show(rows[-1:])
    return rows


def show(rows: list[dict[str, Any]]) -> None:
    """Print one line per row."""
    for row in rows:
        head = f"{row['what']:7}{row['case']:10}{row['seed']:6}"
        if "refused" in row:
            print(head, "refused:", row["refused"])
            continue
        rms = max(row.get("true_rms_deg") or row.get("tracking_rms_deg") or [0.0])
        late = f", {row['late_s']:.2f} s late" if row.get("late_s") is not None else ""
        pull, guard = max(row.get("pull_max_Nm", [0.0])), row["guard"]
        if max(muscles := row.get("muscles_max_Nm", [0.0])) > 0.0:
            late += f", held with {max(muscles):.1f} N·m, {row['v_max_rad_s']:.1f} rad/s at most"
        print(
            f"{head} {rms:5.1f}° RMS{late}, {pull:.2f} N·m at most; guard: stop {guard['stop']}, limited "
            f"{guard['limited_ticks']} of {guard['ticks']}; {row.get('outcome', 'taught')}",
            flush=True,
        )


def main() -> None:
    """Run or load, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1000-1004")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path)
    asked = parser.parse_args()
    if asked.load is not None:
        show(json.loads(asked.load.read_text(encoding="utf-8")))
        return
    first, last = map(int, asked.seeds.split("-"))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, last + 1):
            rows += run(seed, asked.level, Path(folder))
            if asked.save is not None:
                asked.save.write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
