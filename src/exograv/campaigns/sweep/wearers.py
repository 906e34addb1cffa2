"""Grid of wearers and machines, drawn as in the benchmark."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import Annotated, Literal

from pydantic import Field, field_validator

from exograv.campaigns.benchmark_identification.cases import WEARERS_A_MACHINE, Case, population
from exograv.errors import ConfigError
from exograv.laboratory.transparency_summary import profile
from exograv.model.description import load_rig
from exograv.options import WorldName
from exograv.rig.twin.disturbances.levels import ROWS

from .task import Grid

Level = Annotated[int, Field(ge=0, le=4, strict=True)]
Seed = Annotated[int, Field(ge=0, strict=True)]
Several = Field(min_length=1, max_length=1000)

BLOCK = 4 * WEARERS_A_MACHINE
"""Number of wearers drawn at a time. The turns of machines and of third parties' arms repeat after it."""


class WearerGrid(Grid):
    """Grid of wearers, machines, levels and switched disturbances."""

    first_seed: Seed
    """Seed of the first wearer; the others follow. Tune from 1000 on, report from 0."""

    wearers: Annotated[int, Field(ge=1, le=100_000_000, strict=True)]
    arms: Literal["drawn", "mixed"] = "drawn"
    """Source of the arms: drawn, or mixed with every sixth from a third party as in the benchmark."""

    rigs: Annotated[list[str], Several] = Field(default=["recupera_like"])
    """Machines by name, or by folders that every worker can read."""

    machine_seeds: list[Seed] | None = None
    """Seeds of machines for every wearer; one machine for every three wearers if absent."""

    levels: Annotated[list[Level], Several] = Field(default=[2])
    worlds: Annotated[list[WorldName], Several] = Field(default=["home"])
    """Worlds whose laws act."""

    whole: bool = True
    """True to include the case without a switched disturbance."""

    only: list[str] = Field(default=[])
    """Rows that are each run alone at the level, with all others at level 0."""

    without: list[str] = Field(default=[])
    """Rows that are each switched off in turn."""

    @field_validator("only", "without")
    @classmethod
    def _are_rows(cls, rows: list[str]) -> list[str]:
        if unknown := [row for row in rows if row not in ROWS]:
            raise ValueError(f"no disturbance '{unknown[0]}'; known: {', '.join(ROWS)}")
        return rows

    @cached_property
    def variants(self) -> list[tuple[str | None, str | None]]:
        """Pairs of the disturbances `only` and `without`."""
        plain = [(None, None)] if self.whole else []
        return [*plain, *((row, None) for row in self.only), *((None, row) for row in self.without)]

    @cached_property
    def machines(self) -> list[tuple[str, str]]:
        """Name or folder of every machine, and its hash.

        Raises:
            ConfigError: A machine does not exist.
        """
        return [(rig, load_rig(rig).sha256) for rig in self.rigs]

    @property
    def cases_count(self) -> int:
        """Number of pairs of wearer and machine."""
        machines = 1 if self.machine_seeds is None else len(self.machine_seeds)
        return self.wearers * machines * len(self.rigs) * len(self.levels) * len(self.worlds) * len(self.variants)

    def cases(self) -> Iterator[tuple[str, list[Case]]]:
        """Yield the machine's hash, and the wearers between two of its calibrations."""
        for rig, sha256 in self.machines:
            for level, world, (only, without) in product(self.levels, self.worlds, self.variants):
                for group in self._wearers(rig, level, world, only, without):
                    yield sha256, group

    def _wearers(
        self, rig: str, level: int, world: WorldName, only: str | None, without: str | None
    ) -> Iterator[list[Case]]:
        named = {"profile": profile(load_rig(rig)), "rig": rig, "world": world}
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
    """Check that the worker's copy of a machine is the one for which the sweep was made.

    Raises:
        ConfigError: The copy differs.
    """
    if (found := case.description.sha256) != sha256:
        raise ConfigError(
            f"The machine '{case.rig}' of this worker has another rig.toml or URDF ({found[:12]}, not "
            f"{sha256[:12]}). Copy the sweep's folder of the machine there."
        )
