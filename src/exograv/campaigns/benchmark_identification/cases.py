"""Who is identified in which machine: the population of the benchmark, from its seeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Literal

from exograv.errors import ConfigError
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, laboratory_at
from exograv.model.description import RigDescription, load_rig
from exograv.options import Profile
from exograv.rig.twin import Disturbances, WearerModel, read_wearer_model
from exograv.rig.twin.disturbances.levels import MACHINE

ArmName = Literal["drawn", "arm26", "rajagopal"]

RIGS: Mapping[Profile, str] = MappingProxyType({"harmonic": "recupera_like", "qdd": "recupera_like_qdd"})
"""The same machine on two kinds of drives."""

WEARERS_A_MACHINE = 3
"""People whom a laboratory puts into one machine between two calibrations."""

FOREIGN_EVERY = 6
"""Every so many-th wearer is a third party's arm, in turn."""

RESTLESS_LEVEL = 4
"""Of the muscle torque of a wearer who never lets go."""

FOREIGN: tuple[ArmName, ...] = ("arm26", "rajagopal")


@dataclass(frozen=True)
class Case:
    """One wearer in one machine."""

    profile: Annotated[Profile, "kind of drive"]
    level: Annotated[int, "of the disturbances"]
    wearer_seed: Annotated[int, "draws the wearer"]
    machine_seed: Annotated[int, "draws the machine"]
    turn: Annotated[int, "wearers whom the machine had since it was calibrated"] = 0
    arm: Annotated[ArmName, "`drawn`, or whose"] = "drawn"
    """Fit, passive joints and unrest are drawn for everybody."""

    only: Annotated[str | None, "the one disturbance at the level"] = None
    """All others are at level 0; None takes all."""

    without: Annotated[str | None, "a disturbance switched off"] = None
    restless: Annotated[bool, "the wearer never lets go"] = False
    """The wearer stirs as at level 4."""

    rig: Annotated[str | None, "machine"] = None
    """By name or folder, in place of the profile's."""

    @property
    def disturbances(self) -> Disturbances:
        """Level of every row."""
        if self.only is not None:
            return Disturbances.at_level(0).with_row(self.only, self.level)
        rows = Disturbances.at_level(self.level)
        if self.restless:
            rows = rows.with_row("slow_bias", RESTLESS_LEVEL).with_row("bursts", RESTLESS_LEVEL)
        return rows if self.without is None else rows.without(self.without)

    @property
    def machine_key(self) -> tuple[str, int, tuple[int | None, ...], str | None]:
        """Cases with the same key share a machine, and its calibration: the wearer's rows are not the machine's."""
        levels = self.disturbances.levels
        return self.profile, self.machine_seed, tuple(levels[row] for row in MACHINE), self.rig

    @property
    def description(self) -> RigDescription:
        """The machine as its folder describes it."""
        return load_rig(self.rig or RIGS[self.profile])

    def laboratory(self) -> VirtualLaboratory:
        """Machine and wearer; only the twin and its examiner look inside.

        Raises:
            ConfigError: A third party's arm is not there.
            ModelError: It cannot be used.
        """
        description = self.description
        foreign = None if self.arm == "drawn" else _foreign_arm(self.arm, description)
        return laboratory_at(description, self.disturbances, self.machine_seed, self.wearer_seed, foreign)


def population(
    profile: Profile,
    level: int,
    count: int,
    seed_from: int,
    only: str | None = None,
    without: str | None = None,
    restless: bool = False,
) -> list[Case]:
    """`count` wearers with seeds from `seed_from` on; a few share a machine, some are third parties' arms.

    Raises:
        ConfigError: No such disturbance.
    """
    for row in (only, without):
        if row is not None:
            Disturbances.at_level(0).without(row)
    return [
        Case(
            profile,
            level,
            wearer_seed=seed_from + k,
            machine_seed=seed_from + k - k % WEARERS_A_MACHINE,
            turn=k % WEARERS_A_MACHINE,
            arm=_arm_of(k),
            only=only,
            without=without,
            restless=restless,
        )
        for k in range(count)
    ]


def by_machine(cases: Sequence[Case]) -> list[list[Case]]:
    """The same cases, those of one machine together: it is calibrated once."""
    groups: dict[tuple[object, ...], list[Case]] = {}
    for case in cases:
        groups.setdefault(case.machine_key, []).append(case)
    return list(groups.values())


def wearers_folder() -> Path:
    """Folder of the third parties' arms: beside the package when installed, else in the source tree."""
    installed = Path(__file__).parents[2] / "wearers"
    return installed if installed.is_dir() else Path(__file__).parents[4] / "examples" / "wearers"


def _arm_of(k: int) -> ArmName:
    turn, left = divmod(k, FOREIGN_EVERY)
    return FOREIGN[turn % len(FOREIGN)] if left == FOREIGN_EVERY - 1 else "drawn"


def _foreign_arm(name: ArmName, description: RigDescription) -> WearerModel:
    folder = wearers_folder()
    model, told = folder / f"{name}.xml", folder / f"{name}.toml"
    if not (model.is_file() and told.is_file()):
        raise ConfigError(
            f"The arm '{name}' of the benchmark is not in {folder}. Install exograv whole, or run from its source tree."
        )
    return read_wearer_model(model, told, description)
