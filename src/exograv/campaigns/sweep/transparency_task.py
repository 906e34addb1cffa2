"""What a person feels of a machine: muscle effort of one movement in six conditions, as `exograv transparency`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from exograv.errors import ConfigError
from exograv.laboratory.transparency import MovementName, movement_for
from exograv.laboratory.transparency_trial import CONDITIONS, TransparencyTrial, run_trial
from exograv.model.description import load_rig
from exograv.study.folder.columns import Column

from .task import Grid, SweepTask, TaskKind, Values, each
from .wearers import Level, Seed, Several


@dataclass(frozen=True)
class TransparencyTask:
    """One machine with its wearer."""

    rig: str
    rig_sha256: str
    level: int
    seed: int
    movement: MovementName


class TransparencyGrid(Grid):
    """Machines with their wearers."""

    first_seed: Seed
    machines: Annotated[int, Field(ge=1, le=100_000_000)]
    rigs: Annotated[list[str], Several] = Field(default=["recupera_like"])
    levels: Annotated[list[Level], Several] = Field(default=[2])
    movement: MovementName = "pointing"

    def __len__(self) -> int:
        return self.machines * len(self.rigs) * len(self.levels)

    def groups(self) -> Iterator[Sequence[TransparencyTask]]:
        """Each by itself."""
        for rig in self.rigs:
            sha256 = load_rig(rig).sha256
            for level in self.levels:
                for seed in range(self.first_seed, self.first_seed + self.machines):
                    yield [TransparencyTask(rig, sha256, level, seed, self.movement)]


def _run(task: SweepTask) -> Values:
    settings: TransparencyTask = task.settings
    description = load_rig(settings.rig)
    if description.sha256 != settings.rig_sha256:
        raise ConfigError(f"The machine '{settings.rig}' of this worker is another one. Put the same folder there.")
    trial = TransparencyTrial(description, settings.level, settings.seed)
    efforts = run_trial(trial, movement_for(settings.movement, description), lambda _text, _share: None)
    values = {f"effort_{name}_Nms": float(effort.absolute.sum()) for name, effort in efforts.items()}
    return values | {"tracking_error_deg": max(float(effort.tracking_deg.max()) for effort in efforts.values())}


TRANSPARENCY = TaskKind(
    "transparency",
    "Muscle effort of one movement in six conditions.",
    TransparencyGrid,
    (
        Column("rig", "string", "-", "machine"),
        Column("rig_sha256", "string", "-", "of its rig.toml and URDF"),
        Column("level", "int64", "-", "of the disturbances"),
        Column("seed", "int64", "-", "draws machine and wearer"),
        Column("movement", "string", "-", "`pointing` or `recorded`"),
    ),
    (
        *(Column(f"effort_{name}_Nms", "float64", "N·m·s", what, True) for name, what in CONDITIONS.items()),
        Column("tracking_error_deg", "float64", "°", "worst joint in the worst condition", is_nullable=True),
    ),
    ("seed",),
    each(_run),
)
