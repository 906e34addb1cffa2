"""Streams of virtual wearers in files, to tune a method repeatedly without running the twin again.

    python benchmarks/streams.py --seeds 1000-1005 --level 2 --profile harmonic --folder out/streams

Then `for recorded in load(Path("out/streams")): ...`. A method may use `recorded.stream`. The truth is
`recorded.laboratory`; only `laboratory.truth_score.Examination` may use it. Tune on seeds from 1000 on; report seeds
from 0 on. The files are pickles of this version of exograv: for a temporary folder, not for an archive.
"""

import argparse
import pickle
from collections.abc import Iterator
from pathlib import Path

from exograv.campaigns.benchmark_identification.cases import by_machine, population
from exograv.campaigns.benchmark_identification.streams import RecordedStream, calibrate, record_stream
from exograv.errors import ExogravError
from seeds import seed_range


def save(recorded: RecordedStream, folder: Path) -> Path:
    """Write one stream; the name of the file identifies the wearer."""
    case = recorded.case
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{case.profile}-level{case.level}-seed{case.wearer_seed}.pickle"
    path.write_bytes(pickle.dumps(recorded, protocol=5))
    return path


def load(folder: Path, pattern: str = "*") -> Iterator[RecordedStream]:
    """Yield the streams of a folder, sorted by name, one at a time: each takes 15 MB."""
    for path in sorted(folder.glob(f"{pattern}.pickle")):
        yield pickle.loads(path.read_bytes())


def main() -> None:
    """Record the streams; keep files that already exist."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1000-1005")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--profile", choices=("harmonic", "qdd"), default="harmonic")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--folder", type=Path, required=True)
    options = parser.parse_args()
    seeds = seed_range(options.seeds)
    cases = population(options.profile, options.level, len(seeds), seeds[0])

    def silent(_text: str, _share: float) -> None:
        """Ignore progress: one line per stream is enough."""

    for group in by_machine(cases):
        calibrated = calibrate(group[0], silent)
        for case in group:
            try:
                print(save(record_stream(case, calibrated, silent, options.seconds), options.folder), flush=True)
            except ExogravError as error:
                print(f"seed {case.wearer_seed}: {error}", flush=True)


if __name__ == "__main__":
    main()
