r"""Comparison of all identification methods on the same recorded logs of a robot with a known load.

    python benchmarks/log_methods.py LOADED.csv --unloaded UNLOADED.csv --urdf ur10e.urdf \
        --payload-frame wrist_3_link --gains 13.56,12.09,10.15,9.69,10.06,10.46 --true-kg 2.805

Each row is `exograv arm identify-log --method`. Settings of a method are tuned in a rehearsal on the unloaded log.
Off-line methods give an estimate every 5 s, the others every 0.1 s.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

from exograv.errors import ExogravError
from exograv.procedures.machine_tools.identify_log import METHODS, identify_log
from exograv.procedures.machine_tools.options import LogOptions
from exograv.results import json_value


def main() -> None:
    """Run each method and print one line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--unloaded", type=Path, required=True)
    parser.add_argument("--urdf", type=Path, required=True)
    parser.add_argument("--payload-frame", required=True)
    parser.add_argument("--gains", required=True)
    parser.add_argument("--true-kg", type=float, required=True)
    parser.add_argument("--rows")
    parser.add_argument("--rows-unloaded")
    parser.add_argument("--gain-sd", type=float, default=0.0)
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--json", type=Path)
    options = vars(parser.parse_args())
    names, path = options.pop("methods").split(","), options.pop("json")
    options["gains"] = [float(gain) for gain in options["gains"].split(",")]
    results = []
    print("| method | mass kg | error % | 95 % interval kg | holds it | within 10 % to the end from s | took s |")
    print("|---|---|---|---|---|---|---|")
    for name in names:
        begun = time.monotonic()
        try:
            results.append(json_value(identify_log(LogOptions(method=name, **options))))
        except ExogravError as error:
            print(f"| `{name}` | {error} |")
            continue
        print(_row(results[-1], time.monotonic() - begun), flush=True)
    if path is not None:
        path.write_text(json.dumps(results, indent=1, ensure_ascii=False), encoding="utf-8")


def _row(result: dict[str, Any], took_s: float) -> str:
    mass, true = result["payload"]["mass_kg"], result["true_kg"]
    interval, within = result["payload"]["ci95_kg"], result["time_to_10pct_s"]
    span = "none" if interval is None else f"{interval[0]:.3f}–{interval[1]:.3f}"
    holds = "–" if interval is None else ("yes" if interval[0] <= true <= interval[1] else "no")
    since = "never" if within is None else f"{within:.1f}"
    error = 100 * (mass / true - 1)
    return f"| `{result['method']}` | {mass:.3f} | {error:+.1f} | {span} | {holds} | {since} | {took_s:.0f} |"


if __name__ == "__main__":
    main()
