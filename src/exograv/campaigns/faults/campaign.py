"""Campaign of fault scenarios from one seed, on all cores: reaction times, false trips and envelope violations."""

import contextlib
import math
import os
import sys
import tempfile
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from exograv.errors import ConfigError
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.live.live_control import LivePlan
from exograv.loop.pilot import Progress
from exograv.runtime.processes.process_pool import ProcessPool, Tell, in_order

from .checkpoint import KeptVerdicts
from .drive_plant import driven_ground
from .driver_faults import ALL, ONLY_DRIVES
from .evaluation import course_of, figures_of
from .fault_participants import load_participant, prepare_participant
from .fault_plant import FaultParticipant, PlantSource
from .fault_table import EARLIER, FAULTS, Fault
from .figures import CampaignFigures, Strikes
from .healthy import flights_of, fly_healthy
from .options import FaultOptions
from .process_faults import strike
from .scenario import THE_TWIN, Scenario, ScenarioVerdict, fly, is_bad, names_of, shrunk

CHUNK = 20
REPLAYS_MAX = 20

LOST = (
    "Another program ended a process of the campaign, perhaps because memory ran out. With --out, the verdicts so far "
    "are kept: continue with --resume and fewer --processes."
)


@dataclass(frozen=True)
class Campaign(FaultOptions):
    """Scenarios of `exograv dev faults`, and the folder that keeps their verdicts."""

    out: Path | None = None
    """Folder for the verdicts, written as they are reached; without a folder they are not kept."""

    def __post_init__(self):
        """Check the options.

        Raises:
            ConfigError: A value is not allowed.
        """
        super().__post_init__()
        if self.twin == "fitted" and self.rig is None:
            raise ConfigError("--twin is 'fitted', but no machine is named. Give its folder with --rig FOLDER.")
        unknown = [name for name in self._only if name not in self.faults]
        if unknown or not (self.only is None or self._only):
            raise ConfigError(
                f"--only is '{self.only}'; allowed: faults with commas between them. Faults: {', '.join(self.faults)}."
            )

    @property
    def _only(self) -> Sequence[str]:
        """Faults of `--only`; empty without it."""
        return [name.strip() for name in (self.only or "").split(",") if name.strip()]

    def replayed(self) -> Scenario:
        """Scenario of `--replay`.

        Raises:
            ConfigError: The fault does not exist, or the number is missing.
        """
        number, _, faults = (self.replay or "").partition(":")
        names = tuple(names_of(faults))
        unknown = [name for name in names if name not in self.faults]
        if not number.isdecimal() or unknown or bool(names) == (self.healthy_hours is not None):
            raise ConfigError(
                f"--replay is '{self.replay}'; allowed: NUMBER:FAULT or NUMBER:FAULT+FAULT as a campaign prints it, "
                "and NUMBER: with --healthy-hours. "
                f"Faults: {', '.join(self.faults)}."
            )
        return Scenario(self.seed, int(number), names, self.told)

    @property
    def identity(self) -> dict[str, int | str | None]:
        """Settings that determine the flight of each scenario number."""
        numbered = None if self.through is None else self.scenarios
        # Home is not named, so that earlier campaigns continue.
        named = ("seed", "level", "persons", "through", *(() if self.world == "home" else ("world",)))
        named = (*named, *(() if self.only is None else ("only",)))
        named = (*named, *(() if self.rig is None else ("rig", "twin")))
        kind = "faults" if self.healthy_hours is None else "healthy use"
        return {name: getattr(self, name) for name in named} | {"numbered": numbered, "kind": kind}

    @property
    def told(self) -> str:
        """Options that a replay command of one of its scenarios needs besides seed and number."""
        usual = Campaign()
        named = ("level", "world", "rig", "twin", "persons", "through", "healthy_hours")
        names = [name for name in named if getattr(self, name) != getattr(usual, name)]
        return "".join(f" --{name.replace('_', '-')} {getattr(self, name)}" for name in names)

    @property
    def faults(self) -> Mapping[str, Fault]:
        """Faults by identifier that the campaign may fly."""
        return FAULTS if self.through is None else ALL

    def scenario(self, number: int) -> Scenario:
        """Scenario of this number: first those of the twin's fault table, then the faults that only drives have.

        A scenario of healthy use has no fault.
        """
        if self.healthy_hours is not None:
            return Scenario(self.seed, number, (), self.told)
        if only := self._only:
            return Scenario(self.seed, number, (only[number // self.persons % len(only)],), self.told)
        own = number - self.scenarios
        if own < 0:
            return Scenario.drawn(self.seed, number, self.told)
        return Scenario(self.seed, number, (list(ONLY_DRIVES)[own % len(ONLY_DRIVES)],), self.told)

    @property
    def numbers(self) -> range:
        """Numbers of all scenarios. Through a driver, faults that only drives have are flown as often as a row."""
        if self.healthy_hours is not None:
            return range(flights_of(self.healthy_hours))
        own = (
            0
            if self.through is None or self.only is not None
            else len(ONLY_DRIVES) * math.ceil(self.scenarios / len(EARLIER))
        )
        return range(self.scenarios + own)


def run_campaign(campaign: Campaign, progress: Progress) -> CampaignFigures:
    """Simulate all scenarios, and reduce the first failed ones to small scenarios that still fail.

    Raises:
        ConfigError: An option cannot be used.
        ExogravError: A machine or a person could not be prepared.
    """
    with tempfile.TemporaryDirectory() as folder:
        if campaign.replay is not None:
            return _replayed(campaign, Path(folder), progress)
        kept = KeptVerdicts(campaign.out or Path(folder), campaign.identity, campaign.resume)
        verdicts, people = _flown(campaign, Path(folder), kept, progress)
        # A campaign that was stopped early may have verdicts of a participant whose file it has not made yet.
        bad = [one for one in verdicts if is_bad(one) and one.scenario.number % campaign.persons < len(people)]
        bad = bad[:REPLAYS_MAX]
        small = []
        for k, verdict in enumerate(bad):
            progress("Shrinking failed scenarios", k / len(bad))
            with _ground(people[verdict.scenario.number % campaign.persons], campaign) as (who, ground):
                small.append(shrunk(who, verdict, ground) if verdict.scenario.faults else verdict.scenario)
        # Stopping processes and limiting their resources uses Linux functions.
        may_strike = len(verdicts) == len(campaign.numbers) and sys.platform.startswith("linux")
        # Strikes hit the processes of a live run on the twin, independent of the scenarios before.
        may_strike = may_strike and campaign.through is None and bool(people)
        figures = replace(_figures(campaign, verdicts), replay=[scenario.command for scenario in small])
        if campaign.strikes and may_strike and campaign.healthy_hours is None:
            figures = figures.with_strikes(_struck(campaign, people[0], progress))
    return figures


def _struck(campaign: Campaign, path: Path, progress: Progress) -> Strikes:
    """Strike a live run. It comes after the scenarios, because it needs the processors for itself."""
    known = load_participant(path)
    return strike(
        LivePlan(
            known.laboratory.description,
            known.laboratory.form,
            known.prepared,
            known.person,
            0.0,
            cooperative_machine(known.laboratory, campaign.seed, known.prepared.t),
        ),
        campaign.strikes,
        progress,
    )


def _figures(campaign: Campaign, verdicts: list[ScenarioVerdict]) -> CampaignFigures:
    return figures_of(verdicts, campaign.faults, campaign.seed, campaign.level, campaign.through, campaign.world)


def _replayed(campaign: Campaign, folder: Path, progress: Progress) -> CampaignFigures:
    scenario = campaign.replayed()
    person = scenario.number % campaign.persons
    path = prepare_participant(
        campaign.seed, person, campaign.level, folder, progress, campaign.world, campaign.rig, campaign.twin
    )
    with _ground(path, campaign) as (who, ground):
        verdict = _flown_one(who, scenario, ground)
    return replace(_figures(campaign, [verdict]), course=course_of(verdict))


def _flown(
    campaign: Campaign, folder: Path, kept: KeptVerdicts, progress: Progress
) -> tuple[list[ScenarioVerdict], list[Path]]:
    """Verdicts in the order of their numbers, and the participants' files.

    Ctrl-C ends the campaign with the verdicts so far, if there are any.
    """
    people: list[Path] = []
    # Even a single worker is a separate process, so that a scenario that crashes its process loses nothing else.
    with ProcessPool(campaign.processes or os.cpu_count() or 1) as pool:
        try:
            progress("Preparing participants", 0.0)
            wanted = range(min(campaign.persons, len(campaign.numbers)))
            for path in in_order(pool.results(partial(_make_known, campaign, folder), wanted, LOST)):
                people.append(path)
                progress("Preparing participants", len(people) / len(wanted))
            chunks = _chunks(campaign, kept.verdicts)
            arriving = pool.results(partial(_fly_chunk, campaign, people), chunks, LOST)
            for done, (_, verdicts) in enumerate(arriving, start=1):
                kept.add(verdicts)
                progress("Flying scenarios", done / len(chunks))
        except KeyboardInterrupt:
            if not kept.verdicts:
                raise
            progress("Stopped by Ctrl-C; the scenarios flown so far are summed up", 1.0)
    return [kept.verdicts[number] for number in campaign.numbers if number in kept.verdicts], people


def _chunks(campaign: Campaign, done: Container[int] = ()) -> list[tuple[int, list[int]]]:
    """Participant and scenario numbers of each chunk, in an order in which consecutive chunks change participant."""
    left = [number for number in campaign.numbers if number not in done]
    by_person = [[number for number in left if number % campaign.persons == k] for k in range(campaign.persons)]
    # A flight of healthy use takes minutes and is kept alone.
    size = CHUNK if campaign.healthy_hours is None else 1
    chunks = [(k, numbers[i : i + size]) for k, numbers in enumerate(by_person) for i in range(0, len(numbers), size)]
    return sorted(chunks, key=lambda chunk: chunk[1][0])


def _make_known(campaign: Campaign, folder: Path, person: int, _tell: Tell) -> Iterator[Path]:
    yield prepare_participant(
        campaign.seed, person, campaign.level, folder, world=campaign.world, rig=campaign.rig, twin=campaign.twin
    )


def _fly_chunk(
    campaign: Campaign, people: Sequence[Path], chunk: tuple[int, list[int]], _tell: Tell
) -> Iterator[list[ScenarioVerdict]]:
    person, numbers = chunk
    with _ground(people[person], campaign) as (who, ground):
        yield [_flown_one(who, campaign.scenario(number), ground) for number in numbers]


def _flown_one(who: FaultParticipant, scenario: Scenario, ground: PlantSource) -> ScenarioVerdict:
    return (fly if scenario.faults else fly_healthy)(who, scenario, ground)


@contextlib.contextmanager
def _ground(path: Path, campaign: Campaign) -> Iterator[tuple[FaultParticipant, PlantSource]]:
    """Participant of this file, and the source of plants for their flights."""
    if campaign.through is None:
        yield load_participant(path), THE_TWIN
        return
    with driven_ground(campaign.through, path) as (who, ground):
        yield who, ground
