"""`exograv bench`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exograv.cli.shell.base_options import Common, refuse_unwritable, write_json


@dataclass(frozen=True)
class Bench(Common):
    """Time our kernels beside every opponent that is installed (`make bench-setup` installs them)."""

    quick: bool = False
    """A minute in place of half an hour: fewer and shorter rows, and JAX only where it compiles fast."""

    save: Path | None = None
    """Keep the run in this file."""

    compare: Path | None = None
    """Show what became faster or slower since the run in this file."""


def run_bench_command(command: Bench) -> dict[str, Any]:
    """Run it and show its tables."""
    from exograv.bench.compare import read_run, show_changes
    from exograv.bench.run import run_bench
    from exograv.bench.table import show_bench
    from exograv.cli.shell.terminal import bars

    before = None if command.compare is None else read_run(command.compare)
    if command.save is not None:
        refuse_unwritable(command.save, "--save")
    with bars() as progress:
        result = run_bench(command.quick, progress)
    show_bench(result)
    if command.save is not None:
        write_json(command.save, result, "--save")
    if before is not None and command.compare is not None:
        show_changes(before, result, command.compare.name)
    return result
