"""Mutation test of a room: one line at a time is made wrong, and the tests must fail.

    nice -n 10 python benchmarks/mutants.py                          # all
    nice -n 10 python benchmarks/mutants.py --only core --workers 2  # one file, two mutants at a time
    nice -n 10 python benchmarks/mutants.py --sample 100 --seed 1    # some
    nice -n 10 python benchmarks/mutants.py --room runtime           # mailboxes, lines and commands
    python benchmarks/mutants.py --branches                          # conditions that no test has seen both ways

The working tree is never touched: a process is forked for every mutant. A change inside a function that did not run
while the tests were imported replaces the code of that function. All other changes import the changed module. An
interpreter that a test starts imports it, too.

The tests that killed the last mutants in the least time run first, and the first failure ends a run. Results are noted
in a file and not repeated: of a killed mutant until its module or the test that killed it changes, of a survivor until
any test changes. `equivalent_mutants.toml` lists changes that no test can find, each with the reason; `--equivalent`
tries them too, and a killed one is an error.
"""

import argparse
import os
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from guard_mutants import EQUIVALENT, ROOMS, Mutant, Room, digest, equivalents, find_equivalents, mutants, name_of
from mutant_log import Log
from mutant_runs import (
    NOT_FOUND,
    Order,
    Place,
    Prepared,
    Result,
    Run,
    be_quiet,
    be_wrong_elsewhere,
    functions_of,
    place_of,
    prepare,
    run_collected,
    run_imported,
    run_pytest,
    side_by_side,
)
from seen_branches import watch

TIMES_AS_LONG, LONGER_S = 3.0, 20.0
"""Processor time of a mutant, as a multiple of the tests' own and beyond it [s]; a mutant that needs more is killed."""


class Hunt:
    """Run of some mutants; the results are in the log."""

    def __init__(self, room: Room, log: Log, workers: int):
        self.room, self.log, self.workers = room, log, workers
        key = digest("unchanged", *(path.read_text(encoding="utf-8") for path in room.modules))
        if log.result(key) is None:
            for _, result in side_by_side([None], lambda _: run_imported(room, {}, Order({})), 1, 1e4):
                if result[0] != 0:
                    sys.exit(f"{result[1]} fails on the unchanged source. Correct it: a mutant would prove nothing.")
                log.add({"key": key, "killed": False, "name": "unchanged", "seconds": result[2]})
        self.order = Order(log.known[key]["seconds"])
        self.limit_s = TIMES_AS_LONG * sum(self.order.seconds.values()) + LONGER_S
        self.called, self._files = set[tuple[str, Place]](), {str(path) for path in room.modules}

    def run(self, found: list[Mutant]) -> None:
        """Try mutants inside functions in one process with collected tests, and then all others."""
        for _ in side_by_side([None], lambda _: self._inside(found), 1, 1e6):
            pass
        self.log.read()

        def imported(one: Mutant) -> Result:
            if self.room.starts_processes:
                be_wrong_elsewhere(one)
            return run_imported(self.room, {name_of(one.path): one.tree()}, self.order, one.path.name)

        self._note_all(side_by_side(self._unknown(found), imported, self.workers, self.limit_s), sys.stdout.fileno())

    def _unknown(self, found: list[Mutant]) -> list[Mutant]:
        return [one for one in found if self.log.result(one.key) is None]

    def _inside(self, found: list[Mutant]) -> Result:
        out, run = os.dup(1), Run(self.order, "")
        be_quiet()

        def work(items: list[pytest.Item], run: Run) -> None:
            sys.setprofile(None)
            functions = functions_of(self.room)
            ready = [one for one in self._unknown(found) if one.function and not self._was_called(one)]

            def collected(one: Mutant) -> Result:
                if self.room.starts_processes:
                    be_wrong_elsewhere(one)
                return run_collected(items, run, functions, one)

            self._note_all(side_by_side(ready, collected, self.workers, self.limit_s), out)

        sys.setprofile(self._note_call)
        return run_pytest(self.room, Prepared(work, run), run), "", {}

    def _note_call(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename in self._files:
            self.called.add((code.co_filename, place_of(code)))

    def _was_called(self, one: Mutant) -> bool:
        return any(file == str(one.path) and name == one.function for file, (name, _) in self.called)

    def _note_all(self, results: Iterator[tuple[Mutant, Result]], out: int) -> None:
        for one, result in results:
            if result[0] == NOT_FOUND:
                continue
            self.log.note(one.key, one.name, result)
            if result[0] == 0:
                os.write(out, f"survived: {one.name}\n".encode())
            elif result[1]:
                self.order.note(result[1])


def hunt(options: argparse.Namespace) -> None:
    """Try the mutants; print survivors, and how many were killed in each file."""
    room = ROOMS[options.room]
    found, files = [one for one in mutants(room) if options.only in one.path.name], {one.name for one in room.modules}
    rows = [row for row in equivalents() if options.only in row.file and row.file in files]
    equivalent, wrong = find_equivalents(found, rows)
    if wrong:
        sys.exit(
            "\n".join([f"{EQUIVALENT.name} has changes that are no mutants, or of another number of places:", *wrong])
        )
    if options.at:
        found = [one for one in found if any(f"{one.name} ".startswith(place) for place in options.at)]
    if options.sample:
        found = random.Random(options.seed).sample(found, min(options.sample, len(found)))
    tried = [one for one in found if options.equivalent or one not in equivalent]
    run = Hunt(room, Log(options.log, room), options.workers)
    run.run(tried)
    log = run.log
    log.read()
    counts = dict[str, Counter[str]]()
    for one in found:
        state = "killed" if log.result(one.key) else "equivalent" if one in equivalent else "survived"
        if state == "killed" and one in equivalent:
            print(f"killed, so not equivalent: {one.name}")
        for name in (one.path.name, "all"):
            counts.setdefault(name, Counter())[state] += 1
    for name, count in counts.items():
        tried_here = count.total() - count["equivalent"]
        share = 100.0 * count["killed"] / max(tried_here, 1)
        print(
            f"{name}: {count.total()} mutants, {count['killed']} killed, {count['equivalent']} equivalent, "
            f"{count['survived']} survived; {share:.1f} % of those that are not equivalent killed"
        )


def show(options: argparse.Namespace) -> None:
    """Print each survivor in the log as a row of the table of equivalent mutants."""
    room = ROOMS[options.room]
    log = Log(options.log, room)
    found = [one for one in mutants(room) if options.only in one.path.name]
    equivalent, _ = find_equivalents(found, equivalents())
    for one in found:
        if log.result(one.key) is False and one not in equivalent:
            was, becomes = one.lines()
            print(f"{one.name}\n  {one.path.name} {one.function or '-'}\n    {was}\n    {becomes}")


def main() -> None:
    """Run the mutants, or watch the branches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--room", choices=ROOMS, default="safety")
    parser.add_argument("--sample", type=int, default=0, help="number of mutants, drawn at random; 0 for all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="part of the name of a file")
    parser.add_argument("--at", nargs="*", default=[], help="beginnings of names, as `core.py:671:25 `; all if absent")
    parser.add_argument("--log", type=Path, default=Path(tempfile.gettempdir()) / "exograv_mutants.jsonl")
    parser.add_argument("--workers", type=int, default=1, help="number of mutants at a time")
    parser.add_argument("--equivalent", action="store_true", help="also try the mutants listed as equivalent")
    parser.add_argument("--lines", action="store_true", help="only print the changed lines of the survivors in the log")
    parser.add_argument("--branches", action="store_true")
    parser.add_argument("--count", action="store_true", help="only print the number of mutants")
    options = parser.parse_args()
    os.environ["EXOGRAV_GUARD"] = "source"  # A mutant is Python; the compiled guard would not notice it.
    prepare()
    if options.count:
        for name, count in Counter(one.path.name for one in mutants(ROOMS[options.room])).items():
            print(name, count)
    elif options.lines:
        show(options)
    elif options.branches:
        watch()
    else:
        hunt(options)


if __name__ == "__main__":
    main()
