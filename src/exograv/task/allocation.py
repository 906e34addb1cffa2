"""Who is in which group: a list drawn before the study, that nobody reads by accident, and what it means for a run."""

import hashlib
import random
from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import Field, model_validator

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings

from .protocol_schema import ExoMode, Protocol

Code = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{3,16}$")]
Hex = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Group(Settings):
    """What happens to those who are in it, in active protocols."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,30}$")]
    exo: ExoMode


class AllocatedPlace(Settings):
    """One participant, and the group under a seal."""

    code: Code
    seal: Hex


class AllocationList(Settings):
    """Groups and places; a seal hides a group from a glance, not from somebody who calculates."""

    study: Annotated[str, Field(min_length=1, max_length=60)]
    salt: Hex
    groups: Annotated[list[Group], Field(min_length=1, max_length=10)]
    places: Annotated[list[AllocatedPlace], Field(min_length=1, max_length=1000)]

    @model_validator(mode="after")
    def _each_once(self) -> "AllocationList":
        for kind, names in (("groups", [g.name for g in self.groups]), ("places", [p.code for p in self.places])):
            if twice := sorted({name for name in names if names.count(name) > 1}):
                raise ValueError(f"{kind} has {', '.join(twice)} twice")
        return self


def draw_list(study: str, codes: Sequence[str], groups: Sequence[Group], seed: int) -> AllocationList:
    """Draw groups in blocks of one place each, so that they never differ by more than one.

    Raises:
        ConfigError: The codes do not fill whole blocks: the last would tell its group.
    """
    if not groups or not codes or len(codes) % len(groups):
        raise ConfigError(
            f"{len(codes)} participants cannot be shared by {len(groups)} groups. Give a multiple of the groups."
        )
    chance = random.Random(seed)
    salt = hashlib.sha256(f"{study}:{chance.getrandbits(256)}".encode()).hexdigest()
    drawn = [group for _ in range(len(codes) // len(groups)) for group in chance.sample(list(groups), len(groups))]
    places = [
        AllocatedPlace(code=code, seal=_seal(salt, code, group.name)) for code, group in zip(codes, drawn, strict=True)
    ]
    return AllocationList(study=study, salt=salt, groups=list(groups), places=places)


def group_of(allocation: AllocationList, code: str) -> Group:
    """In which group a participant is; only the machine needs to know.

    Raises:
        ConfigError: The code has no place, or its seal belongs to none of the groups.
    """
    place = next((place for place in allocation.places if place.code == code), None)
    if place is None:
        raise ConfigError(
            f"Participant '{code}' has no place in the list of study '{allocation.study}'. Check the code; a new "
            "participant takes a code of the list that is still free."
        )
    group = next((one for one in allocation.groups if _seal(allocation.salt, code, one.name) == place.seal), None)
    if group is None:
        raise ConfigError(
            f"The seal of participant '{code}' in the list of study '{allocation.study}' belongs to none of its "
            "groups: the list was edited. Take the one that was drawn before the study."
        )
    return group


def exo_for(protocol: Protocol, group: Group | None) -> ExoMode:
    """What the machine does in a run of this protocol; without a group what the protocol says."""
    return protocol.exo if group is None or protocol.exo != "active" else group.exo


def sizes(allocation: AllocationList) -> Mapping[str, int]:
    """How many are in each group, which may be told before unblinding."""
    names = [group_of(allocation, place.code).name for place in allocation.places]
    return {group.name: names.count(group.name) for group in allocation.groups}


def _seal(salt: str, code: str, group: str) -> str:
    return hashlib.sha256(f"{salt}:{code}:{group}".encode()).hexdigest()
