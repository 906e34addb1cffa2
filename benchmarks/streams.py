"""Streams of virtual wearers in files, to tune a method on them again and again without flying the twin anew.

    python benchmarks/streams.py --seeds 1000-1005 --level 2 --profile harmonic --folder out/streams

Then `for recorded in load(Path("out/streams")): ...`. What a method may know is `recorded.stream`; the truth is
`recorded.laboratory`, for `session.examine.Examination` alone. Tune on seeds from 1000 on; reported are 0 and after.
The files are pickles of this version of exograv: for a temporary folder, not for an archive.
"""

import argparse
import pickle
from collections.abc import Iterator
from pathlib import Path

from exograv.campaigns.benchmark_identification.cases import by_machine, population
from exograv.campaigns.benchmark_identification.streams import RecordedStream, calibrate, record_stream
from exograv.errors import ExogravError


def save(recorded: RecordedStream, folder: Path) -> Path:
    """Write one stream; the file's name says whose it is."""
    case = recorded.case
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{case.profile}-level{case.level}-seed{case.wearer_seed}.pickle"
    path.write_bytes(pickle.dumps(recorded, protocol=5))
    return path


def load(folder: Path, pattern: str = "*") -> Iterator[RecordedStream]:
    """Streams of a folder, in the order of their names, one at a time: each takes 15 MB."""
    for path in sorted(folder.glob(f"{pattern}.pickle")):
        yield pickle.loads(path.read_bytes())


def main() -> None:
    """Record what is asked for; files that are there already are kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1000-1005")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--profile", choices=("harmonic", "qdd"), default="harmonic")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--folder", type=Path, required=True)
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    cases = population(options.profile, options.level, int(last or first) - int(first) + 1, int(first))

    def silent(_text: str, _share: float) -> None:
        """A line a stream is enough."""

    for group in by_machine(cases):
        calibrated = calibrate(group[0], silent)
        for case in group:
            try:
                print(save(record_stream(case, calibrated, silent, options.seconds), options.folder), flush=True)
            except ExogravError as error:
                print(f"seed {case.wearer_seed}: {error}", flush=True)


if __name__ == "__main__":
    main()
