"""Allocation of participants to groups: a concealed list, drawn before the study, and its effect on a run."""

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
    """Group of a study, and the machine's mode for its members in active protocols."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,30}$")]
    exo: ExoMode


class AllocatedPlace(Settings):
    """Place of one participant. The group is stored as a hash, the seal."""

    code: Code
    seal: Hex


class AllocationList(Settings):
    """Groups and places of a study.

    A seal conceals the group from a reader, but not from a person who computes hashes.
    """

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
    """Draw groups in blocks with one place per group, so that group sizes never differ by more than one.

    Raises:
        ConfigError: The codes do not fill whole blocks. The group of the last participant could be inferred.
    """
    if not groups or not codes or len(codes) % len(groups):
        raise ConfigError(
            f"{len(codes)} participants cannot be divided equally among {len(groups)} groups. Give a multiple of the "
            "number of groups."
        )
    chance = random.Random(seed)
    salt = hashlib.sha256(f"{study}:{chance.getrandbits(256)}".encode()).hexdigest()
    drawn = [group for _ in range(len(codes) // len(groups)) for group in chance.sample(list(groups), len(groups))]
    places = [
        AllocatedPlace(code=code, seal=_seal(salt, code, group.name)) for code, group in zip(codes, drawn, strict=True)
    ]
    return AllocationList(study=study, salt=salt, groups=list(groups), places=places)


def group_of(allocation: AllocationList, code: str) -> Group:
    """Group of a participant. Only the machine needs it.

    Raises:
        ConfigError: The code has no place, or its seal matches none of the groups.
    """
    place = next((place for place in allocation.places if place.code == code), None)
    if place is None:
        raise ConfigError(
            f"Participant '{code}' has no place in the list of study '{allocation.study}'. Check the code. A new "
            "participant gets a free code of the list."
        )
    group = next((one for one in allocation.groups if _seal(allocation.salt, code, one.name) == place.seal), None)
    if group is None:
        raise ConfigError(
            f"The seal of participant '{code}' in the list of study '{allocation.study}' matches none of its "
            "groups: the list was edited. Use the list that was drawn before the study."
        )
    return group


def exo_for(protocol: Protocol, group: Group | None) -> ExoMode:
    """Mode of the machine in a run of this protocol. Without a group, the protocol's own mode."""
    return protocol.exo if group is None or protocol.exo != "active" else group.exo


def sizes(allocation: AllocationList) -> Mapping[str, int]:
    """Return the number of participants in each group. It may be published before unblinding."""
    names = [group_of(allocation, place.code).name for place in allocation.places]
    return {group.name: names.count(group.name) for group in allocation.groups}


def _seal(salt: str, code: str, group: str) -> str:
    return hashlib.sha256(f"{salt}:{code}:{group}".encode()).hexdigest()
