"""What came of careers, a file each: read where it is kept, gone through where it is not."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from exograv.errors import RecordingError
from exograv.runtime.processes.process_pool import Tell, results_of
from exograv.storage.checkpoint import Advice, StateFile

from .careers import Career
from .flight import flight_of
from .options import StudyOptions
from .participants import ParticipantResult, simulate_participant

TOLD_EVERY = 0.01
"""Share of a career between two messages of its process."""

LOST = (
    "A process of the study was ended from outside, perhaps because memory ran out. Careers that were done are kept: "
    "go on with --resume, and with fewer --processes."
)


@dataclass(frozen=True)
class CareerJob:
    """A career, the options that hold for it, and the file that keeps what comes of it."""

    career: Career
    options: StudyOptions
    file: Path


def lived_of(
    jobs: Sequence[CareerJob],
    recordings: Path,
    processes: int,
    tell: Callable[[float], None],
    add: Callable[[ParticipantResult], None] = lambda _lived: None,
) -> list[ParticipantResult]:
    """What came of each, in their order.

    Args:
        jobs: Each with a file of its own.
        recordings: Folder for those that are made.
        processes: At the same time.
        tell: Told the share of all that is done.
        add: Gets what comes of a career before it is kept.

    Raises:
        ExogravError: A machine or run was refused, a file cannot be read, or the disk is full; what is kept stays.
    """
    done = {k: lived for k, job in enumerate(jobs) if (lived := CAREER_FILE.find(job.file)) is not None}
    left = [k for k in range(len(jobs)) if k not in done]
    going = dict[str, float]()

    def told(message: tuple[str, float]) -> None:
        going[message[0]] = message[1]
        tell(min((len(done) + sum(going.values())) / len(jobs), 1.0))

    arriving = results_of(partial(_live, recordings=recordings), [jobs[k] for k in left], processes, told, LOST)
    try:
        for which, lived in arriving:
            job = jobs[left[which]]
            add(lived)
            CAREER_FILE.write(job.file, lived)
            done[left[which]] = lived
            going.pop(job.career.name, None)
    finally:
        arriving.close()
    return [done[k] for k in range(len(jobs))]


def _live(job: CareerJob, tell: Tell, recordings: Path) -> Iterator[ParticipantResult]:
    said = ("", -1.0)

    def told(text: str, share: float) -> None:
        nonlocal said
        if text != said[0] or share >= said[1] + TOLD_EVERY:
            said = (text, share)
            tell(said)

    yield simulate_participant(job.career, job.options, recordings, told)


def _unpacked(content: bytes) -> ParticipantResult:
    plain = json.loads(content)
    flights = tuple(flight_of(one) for one in plain["flights"])
    return ParticipantResult(
        flights, tuple(plain["files"]), plain["spent_s"], plain["simulated_s"], plain.get("refused")
    )


CAREER_FILE = StateFile[ParticipantResult](
    pack=lambda lived: json.dumps(asdict(lived)),
    unpack=_unpacked,
    advice=Advice(
        unreadable="{path} cannot be read: {why}. See whose it is.",
        unreadable_error=RecordingError,
        damaged="{path} cannot be read as what came of a career ({why}). Delete this file, and --resume goes through "
        "that career again.",
    ),
    size_max=None,
)
