r"""Comparison of identification methods on recorded logs of a robot with a known load.

    python benchmarks/log_methods.py LOADED.csv --unloaded A.csv --unloaded B.csv --unloaded A.csv,B.csv \
        --urdf ur10e.urdf --payload-frame wrist_3_link --gains 13.56,12.09,10.15,9.69,10.06,10.46 --true-kg 2.805

Each `--unloaded` is one pair with the loaded log; logs that are separated by commas are used together. Each row is
`exograv arm identify-log --method`. Settings of a method are tuned in a rehearsal on the first unloaded log. Off-line
methods give an estimate every 5 s, the others every 0.1 s. `python benchmarks/log_coverage.py` tests the intervals with
virtual loads.
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
    """Run each method on each pair and print one line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--unloaded", action="append", required=True)
    parser.add_argument("--urdf", type=Path, required=True)
    parser.add_argument("--payload-frame", required=True)
    parser.add_argument("--gains", default="")
    parser.add_argument("--torque", action="store_true")
    parser.add_argument("--true-kg", type=float, required=True)
    parser.add_argument("--rows")
    parser.add_argument("--gain-sd", type=float, default=0.0)
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--json", type=Path)
    options = vars(parser.parse_args())
    names, path, pairs = options.pop("methods").split(","), options.pop("json"), options.pop("unloaded")
    options["gains"] = [float(gain) for gain in options["gains"].split(",") if gain]
    results = []
    print("| method | unloaded | mass kg | error % | 95 % interval kg | holds it | within 10 % from s | took s |")
    print("|---|---|---|---|---|---|---|---|")
    for name in names:
        for pair in pairs:
            unloaded = tuple(Path(text) for text in pair.split(","))
            begun = time.monotonic()
            stems = " + ".join(path.stem for path in unloaded)
            try:
                results.append(json_value(identify_log(LogOptions(method=name, unloaded=unloaded, **options))))
            except ExogravError as error:
                print(f"| `{name}` | {stems} | {error} |")
                continue
            print(_row(results[-1], stems, time.monotonic() - begun), flush=True)
    if path is not None:
        path.write_text(json.dumps(results, indent=1, ensure_ascii=False), encoding="utf-8")


def _row(result: dict[str, Any], stems: str, took_s: float) -> str:
    mass, true = result["payload"]["mass_kg"], result["true_kg"]
    interval, within = result["payload"]["ci95_kg"], result["time_to_10pct_s"]
    span = "none" if interval is None else f"{interval[0]:.3f}–{interval[1]:.3f}"
    holds = "–" if interval is None else ("yes" if interval[0] <= true <= interval[1] else "no")
    since = "never" if within is None else f"{within:.1f}"
    error = 100 * (mass / true - 1)
    return f"| `{result['method']}` | {stems} | {mass:.3f} | {error:+.1f} | {span} | {holds} | {since} | {took_s:.0f} |"


if __name__ == "__main__":
    main()
