"""Speed of a sweep by the number of workers, and a hash that shows if all tables are equal to the byte.

python benchmarks/sweep.py --study examples/sweeps/table.toml --workers 1,2
"""

import argparse
import hashlib
import tempfile
from pathlib import Path

from exograv.campaigns.sweep.options import SweepOptions
from exograv.campaigns.sweep.study_file import load_study
from exograv.campaigns.sweep.sweep_command import run_sweep

EXAMPLE = Path(__file__).parents[1] / "examples" / "sweeps" / "table.toml"


def main() -> None:
    """Run the sweep once for each number of workers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--study", type=Path, default=EXAMPLE)
    parser.add_argument("--workers", default="1,2")
    options = parser.parse_args()
    study = load_study(options.study)
    for workers in map(int, options.workers.split(",")):
        with tempfile.TemporaryDirectory() as folder:
            result = run_sweep(study, SweepOptions(workers), Path(folder), lambda _text, _share: None)
            digest = hashlib.sha256((Path(folder) / "sweep.parquet").read_bytes()).hexdigest()
        print(
            f"{workers} workers: {result.tasks_per_s:.2f} tasks/s, {result.wall_s:.1f} s, {result.done} done, "
            f"table {digest[:12]}",
            flush=True,
        )


if __name__ == "__main__":  # worker processes of a sweep import this file
    main()
