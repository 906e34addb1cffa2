"""The part of a grid that says who is in which machine; people and machines are those of the benchmark."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Literal

from pydantic import Field, field_validator

from exograv.campaigns.benchmark_identification.cases import WEARERS_A_MACHINE, Case, population
from exograv.errors import ConfigError
from exograv.laboratory.transparency_summary import profile
from exograv.model.description import load_rig
from exograv.rig.twin.disturbances.levels import ROWS

from .task import Grid

Level = Annotated[int, Field(ge=0, le=4, strict=True)]
Seed = Annotated[int, Field(ge=0, strict=True)]
Several = Field(min_length=1, max_length=1000)

BLOCK = 4 * WEARERS_A_MACHINE
"""Wearers drawn at a time: after so many the turns of machines and of third parties' arms begin anew."""


class WearerGrid(Grid):
    """Wearers in machines, at levels, with disturbances switched."""

    first_seed: Seed
    """Of the first wearer; the others follow. Tune from 1000 on, report from 0."""

    wearers: Annotated[int, Field(ge=1, le=100_000_000, strict=True)]
    arms: Literal["drawn", "mixed"] = "drawn"
    """Drawn, or every sixth a third party's as in the benchmark."""

    rigs: Annotated[list[str], Several] = Field(default=["recupera_like"])
    """Names of machines, or folders that every worker can read."""

    machine_seeds: list[Seed] | None = None
    """Every wearer in each of these; a machine for every three wearers where it is left out."""

    levels: Annotated[list[Level], Several] = Field(default=[2])
    whole: bool = True
    """Also with no row switched."""

    only: list[str] = Field(default=[])
    """Each of these rows alone at the level, all others at level 0."""

    without: list[str] = Field(default=[])
    """Each of these rows switched off in turn."""

    @field_validator("only", "without")
    @classmethod
    def _are_rows(cls, rows: list[str]) -> list[str]:
        if unknown := [row for row in rows if row not in ROWS]:
            raise ValueError(f"no disturbance '{unknown[0]}'; known: {', '.join(ROWS)}")
        return rows

    @cached_property
    def variants(self) -> list[tuple[str | None, str | None]]:
        """What is switched: only, without."""
        plain = [(None, None)] if self.whole else []
        return [*plain, *((row, None) for row in self.only), *((None, row) for row in self.without)]

    @cached_property
    def machines(self) -> list[tuple[str, str]]:
        """Name or folder, and hash, of every rig.

        Raises:
            ConfigError: There is no such machine.
        """
        return [(rig, load_rig(rig).sha256) for rig in self.rigs]

    @property
    def cases_count(self) -> int:
        """Wearers in machines."""
        machines = 1 if self.machine_seeds is None else len(self.machine_seeds)
        return self.wearers * machines * len(self.rigs) * len(self.levels) * len(self.variants)

    def cases(self) -> Iterator[tuple[str, list[Case]]]:
        """The rig's hash, and the wearers of one machine between two calibrations."""
        for rig, sha256 in self.machines:
            for level in self.levels:
                for only, without in self.variants:
                    for group in self._wearers(rig, level, only, without):
                        yield sha256, group

    def _wearers(self, rig: str, level: int, only: str | None, without: str | None) -> Iterator[list[Case]]:
        named = {"profile": profile(load_rig(rig)), "rig": rig}
        for block in range(0, self.wearers, BLOCK):
            count = min(BLOCK, self.wearers - block)
            cases = population("harmonic", level, count, self.first_seed + block, only, without)
            cases = [replace(case, **named) for case in cases]
            if self.arms == "drawn":
                cases = [replace(case, arm="drawn") for case in cases]
            for first in range(0, count, WEARERS_A_MACHINE):
                group = cases[first : first + WEARERS_A_MACHINE]
                if self.machine_seeds is None:
                    yield group
                for seed in self.machine_seeds or ():
                    yield [replace(case, machine_seed=seed) for case in group]


def refuse_other_rig(case: Case, sha256: str) -> None:
    """A worker's own copy of a machine must be the one that the sweep was made for.

    Raises:
        ConfigError: It is another one.
    """
    if (found := case.description.sha256) != sha256:
        raise ConfigError(
            f"The machine '{case.rig}' of this worker has another rig.toml or URDF ({found[:12]}, not "
            f"{sha256[:12]}). Put the same folder there."
        )
