"""Task kind `participants`: flight touches of one virtual participant after a training (`exograv study simulate`)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from exograv.campaigns.virtual_study.careers import Career
from exograv.campaigns.virtual_study.conditions import condition_of
from exograv.campaigns.virtual_study.flight import FAMILIARISED
from exograv.campaigns.virtual_study.options import StudyOptions
from exograv.campaigns.virtual_study.participants import simulate_participant
from exograv.campaigns.virtual_study.transfer import constant_error_mm, first_touch_mm
from exograv.errors import ConfigError, IdentificationError
from exograv.laboratory.participant.habits import with_constants

from .task import Grid, SweepTask, TaskKind, each
from .wearers import Level, Seed, Several

Sessions = Annotated[int, Field(ge=0, le=99, strict=True)]
Windows = Annotated[int, Field(ge=1, strict=True)]
Constants = dict[str, Annotated[list[float], Several]]


@dataclass(frozen=True)
class ParticipantsTask:
    """Settings of one simulated person: training sessions, and the flight after them."""

    condition: Annotated[str, "condition of the training"]
    """Condition of the training. `FAMILIARISED`: the person only gets used to the passive machine."""

    constants: Annotated[str, "changed constants of the person; `name=value` separated by spaces"]
    sessions: Annotated[int, "sessions before the flight"]
    windows: Annotated[int | None, "windows of each session; the protocol's number where empty"]
    flight_windows: Annotated[int | None, "windows of the flight"]
    level: Annotated[int, "level of the disturbances"]
    seed: Annotated[int, "draws person and machine"]

    @property
    def options(self) -> StudyOptions:
        """Options of a study with this person."""
        changed = (text.split("=") for text in self.constants.split())
        return StudyOptions(
            level=self.level,
            windows=self.windows,
            flight_windows=self.flight_windows,
            constants={name: float(value) for name, value in changed},
        )


@dataclass(frozen=True)
class ParticipantsResult:
    """Result of one flight of a virtual participant."""

    first_window_up_mm: Annotated[float | None, "mean height of the flight's first window"]
    first_touch_up_mm: Annotated[float | None, "height of the flight's first accepted touch"]
    median_px: Annotated[float | None, "median deviation in the flight"]
    touches: Annotated[int | None, "accepted touches in the flight"]
    left_over_Nm: Annotated[float | None, "left over by the machine of the training, worst shoulder axis"]
    friction_Nm: Annotated[float | None, "Coulomb friction of that machine, mean over its joints"]


class ParticipantsGrid(Grid):
    """Grid of people and conditions, with changed constants."""

    first_seed: Seed
    """Seed of the first person; the others follow. Tune from 1000 on, report from 0."""

    people: Annotated[int, Field(ge=1, le=100_000_000, strict=True)]
    """Number of people for each combination of the other settings."""

    conditions: Annotated[list[str], Several] = Field(default=[FAMILIARISED, "dam"])
    """Conditions of docs/results/simulate_study_results.md, and "familiarised", the reference of transfer."""

    sessions: Annotated[list[Sessions], Several] = Field(default=[4])
    """Sessions before the flight, each of 31 windows unless `windows` asks for fewer."""

    windows: Windows | None = None
    flight_windows: Windows | None = 1
    levels: Annotated[list[Level], Several] = Field(default=[2])
    constants: Constants = Field(default={})
    """Values of each constant; every combination of them is run."""

    @field_validator("conditions")
    @classmethod
    def _are_known(cls, names: list[str]) -> list[str]:
        return [name if name == FAMILIARISED else condition_of(name).name for name in names]

    @field_validator("constants")
    @classmethod
    def _differ(cls, constants: Constants) -> Constants:
        for name, values in constants.items():
            if len(set(values)) < len(values):
                raise ValueError(f"{name} has a value twice; name each once.")
            for value in values:
                with_constants({name: value})  # Raises an error for an impossible value.
        return constants

    @cached_property
    def _changed(self) -> list[str]:
        named = [[f"{name}={value!r}" for value in values] for name, values in self.constants.items()]
        return [" ".join(each_of) for each_of in product(*named)]

    def __len__(self) -> int:
        return len(self.conditions) * len(self._changed) * len(self.sessions) * len(self.levels) * self.people

    def groups(self) -> Iterator[Sequence[ParticipantsTask]]:
        """Yield each task alone, because tasks share no work."""
        for k in range(self.people):
            for level, name, count, changed in product(self.levels, self.conditions, self.sessions, self._changed):
                yield [
                    ParticipantsTask(
                        name, changed, count, self.windows, self.flight_windows, level, self.first_seed + k
                    )
                ]


def _run(task: SweepTask) -> ParticipantsResult:
    settings: ParticipantsTask = task.settings
    condition = None if settings.condition == FAMILIARISED else condition_of(settings.condition)
    career = Career(0, settings.seed, condition, settings.sessions, ((settings.sessions, "comparison"),))
    lived = simulate_participant(career, settings.options, Path(), lambda _text, _share: None)
    if lived.refused is not None:
        raise IdentificationError(lived.refused)
    (flight,) = lived.flights
    if not flight.first_window:
        raise ConfigError("No touch in the flight's first window is accepted: this person found the screen too late.")
    median_px = float(np.median([touch.deviation_px for touch in flight.touches]))
    return ParticipantsResult(
        constant_error_mm(flight), first_touch_mm(flight), median_px, len(flight.touches), flight.left_over_Nm,
        flight.friction_Nm,
    )  # fmt: skip


PARTICIPANTS = TaskKind(
    "participants",
    "One virtual participant points in flight, after a training.",
    ParticipantsGrid,
    ParticipantsTask,
    ParticipantsResult,
    ("seed",),
    each(_run),
)
