"""Time our kernels beside every installed opponent (`make bench-setup` installs them).

    python benchmarks/kernels.py --save after.json --compare benchmarks/results.json

`make bench` runs it in full and publishes the result.
"""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

# This must be set before NumPy is imported: our matrices are small, and OpenBLAS threads wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import tyro

from exograv.cli.shell.base_options import refuse_unwritable, write_json
from exograv.cli.shell.terminal import bars
from exograv.errors import ExogravError
from peers.compare import read_run, show_changes
from peers.table import show_bench
from peers.whole_run import run_bench


@dataclass(frozen=True)
class Options:
    """Time our kernels beside every installed opponent."""

    quick: bool = False
    """Take a minute instead of half an hour: fewer and shorter rows, and JAX only where it compiles fast."""

    save: Path | None = None
    """Save the run in this file."""

    compare: Path | None = None
    """Show the changes since the run in this file."""


def main() -> None:
    """Run every section and show its tables."""
    options = tyro.cli(Options, description=__doc__)
    try:
        run(options)
    except ExogravError as error:
        sys.exit(f"kernels.py: {error}")


def run(options: Options) -> None:
    """Measure, show, save and compare.

    Raises:
        RecordingError: A file cannot be read or written.
    """
    before = None if options.compare is None else read_run(options.compare)
    if options.save is not None:
        refuse_unwritable(options.save, "--save")
    with bars() as progress:
        result = run_bench(options.quick, progress)
    show_bench(result)
    if options.save is not None:
        write_json(options.save, result, "--save")
    if before is not None and options.compare is not None:
        show_changes(before, result, options.compare.name)


if __name__ == "__main__":
    main()
