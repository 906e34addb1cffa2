"""Where one virtual participant points in flight after a training, as in `exograv simulate-study`."""

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
    """One person, from the first session through a flight."""

    condition: Annotated[str, "of the training"]
    """`FAMILIARISED`: gets used to the passive machine only."""

    constants: Annotated[str, "of the person, changed; `name=value` by spaces"]
    sessions: Annotated[int, "before the flight"]
    windows: Annotated[int | None, "of each; the protocol's where empty"]
    flight_windows: Annotated[int | None, "of the flight"]
    level: Annotated[int, "of the disturbances"]
    seed: Annotated[int, "draws person and machine"]

    @property
    def options(self) -> StudyOptions:
        """Of a study in which this person is."""
        changed = (text.split("=") for text in self.constants.split())
        return StudyOptions(
            level=self.level,
            windows=self.windows,
            flight_windows=self.flight_windows,
            constants={name: float(value) for name, value in changed},
        )


@dataclass(frozen=True)
class ParticipantsResult:
    """One flight."""

    first_window_up_mm: Annotated[float | None, "mean height of the flight's first window"]
    first_touch_up_mm: Annotated[float | None, "height of its first accepted touch"]
    median_px: Annotated[float | None, "median deviation in the flight"]
    touches: Annotated[int | None, "accepted in the flight"]
    left_over_Nm: Annotated[float | None, "by the machine of the training, worst shoulder axis"]
    friction_Nm: Annotated[float | None, "Coulomb friction of that machine, mean over its joints"]


class ParticipantsGrid(Grid):
    """People in conditions, with constants of theirs changed."""

    first_seed: Seed
    """Of the first person; the others follow. Tune from 1000 on, report from 0."""

    people: Annotated[int, Field(ge=1, le=100_000_000, strict=True)]
    """The same in everything else."""

    conditions: Annotated[list[str], Several] = Field(default=[FAMILIARISED, "dam"])
    """Of docs/simulate_study_conditions.md, and "familiarised", from which transfer is counted."""

    sessions: Annotated[list[Sessions], Several] = Field(default=[4])
    """Before the flight, of 31 windows each unless there are fewer `windows`."""

    windows: Windows | None = None
    flight_windows: Windows | None = 1
    levels: Annotated[list[Level], Several] = Field(default=[2])
    constants: Constants = Field(default={})
    """Every combination of these values."""

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
                with_constants({name: value})  # refuses what cannot be
        return constants

    @cached_property
    def _changed(self) -> list[str]:
        named = [[f"{name}={value!r}" for value in values] for name, values in self.constants.items()]
        return [" ".join(each_of) for each_of in product(*named)]

    def __len__(self) -> int:
        return len(self.conditions) * len(self._changed) * len(self.sessions) * len(self.levels) * self.people

    def groups(self) -> Iterator[Sequence[ParticipantsTask]]:
        """Each by itself."""
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
        raise ConfigError("No touch of the flight's first window counts: this person found the screen too late.")
    median_px = float(np.median([touch.deviation_px for touch in flight.touches]))
    return ParticipantsResult(
        constant_error_mm(flight), first_touch_mm(flight), median_px, len(flight.touches), flight.left_over_Nm,
        flight.friction_Nm,
    )  # fmt: skip


PARTICIPANTS = TaskKind(
    "participants",
    "Where one virtual participant points in flight, after a training.",
    ParticipantsGrid,
    ParticipantsTask,
    ParticipantsResult,
    ("seed",),
    each(_run),
)
