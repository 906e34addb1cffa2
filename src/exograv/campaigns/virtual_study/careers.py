"""Careers of all virtual people of a study, from its options."""

import re
from dataclasses import dataclass

import numpy as np

from .conditions import Condition, condition_of
from .flight import FAMILIARISED, Group
from .options import StudyOptions


@dataclass(frozen=True)
class Career:
    """Sessions and flights of one person in one condition."""

    person: int
    seed: int
    condition: Condition | None
    """Condition of the training; None for familiarisation only."""

    sessions: int
    flights: tuple[tuple[int, Group], ...]
    """Number of sessions before each flight, and the group that it counts for. Each flight starts from the learning so
    far."""

    code: str | None = None
    """Code of the person in the study's folder of recordings; None if nothing is recorded."""

    @property
    def condition_name(self) -> str:
        """Name of the condition in flights."""
        return FAMILIARISED if self.condition is None else self.condition.name

    @property
    def name(self) -> str:
        """Name of the career's checkpoint file."""
        group = "" if self.code is None else "-study"
        return re.sub(r"[^A-Za-z0-9.]+", "-", f"V{self.person:02d}-{self.condition_name}{group}")


def careers(options: StudyOptions, codes: tuple[str, ...]) -> list[Career]:
    """List all careers, longest first: the main study, then the same trained people in the other conditions."""
    trained, untrained = options.participants
    seeds = np.random.default_rng([options.seed, 43]).integers(1000, 2**31, trained + untrained).tolist()
    sessions, familiarisations = options.sessions
    few, fewer = (min(a, b) for a, b in zip(options.compared, options.sessions, strict=True))
    found = list[Career]()
    for person in range(trained + untrained):
        is_trained = person < trained
        last = sessions if is_trained else familiarisations
        flights: list[tuple[int, Group]] = [(last, "trained" if is_trained else "untrained")]
        if is_trained and few != last:
            flights.insert(0, (few, "comparison"))
        condition = options.main if is_trained else None
        found.append(Career(person, seeds[person], condition, last, tuple(flights), codes[person]))
    for text in options.conditions[1:]:
        condition = condition_of(text)
        found += [Career(k, seeds[k], condition, few, ((few, "comparison"),)) for k in range(trained)]
    found += [Career(k, seeds[k], None, fewer, ((fewer, "comparison"),)) for k in range(trained)]
    return found
