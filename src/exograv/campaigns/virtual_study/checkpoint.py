"""Checkpoints of careers, one file each: finished careers are read, the others are simulated."""

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
"""Share of a career between two progress messages of its process."""

LOST = (
    "Another program ended a process of the study, perhaps because memory ran out. Finished careers are kept: continue "
    "with --resume and fewer --processes."
)


@dataclass(frozen=True)
class CareerJob:
    """Career with its options and its checkpoint file."""

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
    """Return the result of each career, in order.

    Args:
        jobs: Careers, each with its own file.
        recordings: Folder for new recordings.
        processes: Number of parallel processes.
        tell: Receives the finished share of all careers.
        add: Receives the result of a career before it is written.

    Raises:
        ExogravError: A machine or run was refused, a file cannot be read, or the disk is full. Written files stay.
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
        unreadable="{path} cannot be read: {why}. Check the owner of the file.",
        unreadable_error=RecordingError,
        damaged="{path} cannot be read as the result of a career ({why}). Delete this file, and --resume simulates "
        "that career again.",
    ),
    size_max=None,
)
