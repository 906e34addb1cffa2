"""Population of the benchmark: wearers and machines, drawn from seeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Literal

from exograv.errors import ConfigError
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, laboratory_at
from exograv.model.description import RigDescription, load_rig
from exograv.options import Profile, WorldName
from exograv.rig.twin import Disturbances, WearerModel, read_wearer_model
from exograv.rig.twin.disturbances.levels import MACHINE

ArmName = Literal["drawn", "arm26", "rajagopal"]

RIGS: Mapping[Profile, str] = MappingProxyType({"harmonic": "recupera_like", "qdd": "recupera_like_qdd"})
"""Machine by drive profile: the same machine with two kinds of drives."""

WEARERS_A_MACHINE = 3
"""Number of people whom a laboratory puts into one machine between two calibrations."""

FOREIGN_EVERY = 6
"""Number of wearers of which one has a third party's arm; these arms take turns."""

RESTLESS_LEVEL = 4
"""Level of the muscle torque of a wearer who never relaxes."""

FOREIGN: tuple[ArmName, ...] = ("arm26", "rajagopal")


@dataclass(frozen=True)
class Case:
    """Pair of a wearer and a machine."""

    profile: Annotated[Profile, "kind of drive"]
    level: Annotated[int, "level of the disturbances"]
    wearer_seed: Annotated[int, "draws the wearer"]
    machine_seed: Annotated[int, "draws the machine"]
    turn: Annotated[int, "number of wearers since the machine was calibrated"] = 0
    arm: Annotated[ArmName, "`drawn`, or name of a published arm"] = "drawn"
    """Source of the arm. Fit, passive joints and unrest are drawn for every wearer."""

    only: Annotated[str | None, "the only disturbance at the level"] = None
    """Single disturbance at the level, all others at level 0; None for all at the level."""

    without: Annotated[str | None, "a disturbance switched off"] = None
    restless: Annotated[bool, "the wearer never relaxes"] = False
    """True if the wearer's muscles are as restless as at level 4."""

    world: Annotated[WorldName, "world whose laws act"] = "home"

    rig: Annotated[str | None, "machine"] = None
    """Machine by name or folder, in place of the profile's machine."""

    @property
    def disturbances(self) -> Disturbances:
        """Disturbances of the twin, each at its level in this case."""
        if self.only is not None:
            return Disturbances.at_level(0, self.world).with_row(self.only, self.level)
        rows = Disturbances.at_level(self.level, self.world)
        if self.restless:
            rows = rows.with_row("slow_bias", RESTLESS_LEVEL).with_row("bursts", RESTLESS_LEVEL)
        return rows if self.without is None else rows.without(self.without)

    @property
    def machine_key(self) -> tuple[str, int, tuple[int | None, ...], str | None, bool]:
        """Key of the machine and its calibration. Cases that differ only in rows of the wearer share it."""
        disturbances = self.disturbances
        levels = tuple(disturbances.levels[row] for row in MACHINE)
        return self.profile, self.machine_seed, levels, self.rig, disturbances.is_foreign("drives")

    @property
    def description(self) -> RigDescription:
        """The machine as its folder describes it."""
        return load_rig(self.rig or RIGS[self.profile])

    def laboratory(self) -> VirtualLaboratory:
        """Machine and wearer. Only the twin and its examiner read their truth.

        Raises:
            ConfigError: The file of a third party's arm is missing.
            ModelError: That arm cannot be used.
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
    world: WorldName = "home",
) -> list[Case]:
    """Return `count` wearers with seeds from `seed_from` on. Some share a machine, some have third parties' arms.

    Raises:
        ConfigError: The disturbance does not exist.
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
            world=world,
        )
        for k in range(count)
    ]


def by_machine(cases: Sequence[Case]) -> list[list[Case]]:
    """Group the cases by machine, which is then calibrated once per group."""
    groups: dict[tuple[object, ...], list[Case]] = {}
    for case in cases:
        groups.setdefault(case.machine_key, []).append(case)
    return list(groups.values())


def wearers_folder() -> Path:
    """Folder of third parties' arms: beside the package if installed, else in the source tree."""
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
            f"The arm '{name}' of the benchmark is not in {folder}. Install all of exograv or run its source tree."
        )
    return read_wearer_model(model, told, description)
