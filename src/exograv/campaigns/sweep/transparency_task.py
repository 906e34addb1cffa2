"""Task kind `transparency`: muscle effort of one movement in six conditions, as in `exograv dev transparency`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, make_dataclass
from typing import Annotated

from pydantic import Field

from exograv.errors import ConfigError
from exograv.laboratory.options import MovementName
from exograv.laboratory.transparency import movement_for
from exograv.laboratory.transparency_trial import CONDITIONS, TransparencyTrial, run_trial
from exograv.model.description import load_rig

from .task import Grid, SweepTask, TaskKind, each
from .wearers import Level, Seed, Several


@dataclass(frozen=True)
class TransparencyTask:
    """Settings of one machine with its wearer."""

    rig: Annotated[str, "machine"]
    rig_sha256: Annotated[str, "SHA-256 of the machine's rig.toml and URDF"]
    level: Annotated[int, "level of the disturbances"]
    seed: Annotated[int, "draws machine and wearer"]
    movement: Annotated[MovementName, "`pointing` or `recorded`"]


EFFORTS = [(f"effort_{name}_Nms", Annotated[float | None, what]) for name, what in CONDITIONS.items()]
TransparencyResult = make_dataclass(
    "TransparencyResult",
    [*EFFORTS, ("tracking_error_deg", Annotated[float | None, "worst joint in the worst condition"])],
    frozen=True,
)
"""Muscle effort in each condition [N·m·s], and the tracking error."""


class TransparencyGrid(Grid):
    """Grid of machines with their wearers."""

    first_seed: Seed
    machines: Annotated[int, Field(ge=1, le=100_000_000)]
    rigs: Annotated[list[str], Several] = Field(default=["recupera_like"])
    levels: Annotated[list[Level], Several] = Field(default=[2])
    movement: MovementName = "pointing"

    def __len__(self) -> int:
        return self.machines * len(self.rigs) * len(self.levels)

    def groups(self) -> Iterator[Sequence[TransparencyTask]]:
        """Yield each task alone, because tasks share no work."""
        for rig in self.rigs:
            sha256 = load_rig(rig).sha256
            for level in self.levels:
                for seed in range(self.first_seed, self.first_seed + self.machines):
                    yield [TransparencyTask(rig, sha256, level, seed, self.movement)]


def _run(task: SweepTask) -> object:
    settings: TransparencyTask = task.settings
    description = load_rig(settings.rig)
    if description.sha256 != settings.rig_sha256:
        raise ConfigError(f"The machine '{settings.rig}' of this worker has other files. Copy the folder there.")
    trial = TransparencyTrial(description, settings.level, settings.seed)
    efforts = run_trial(trial, movement_for(settings.movement, description), lambda _text, _share: None)
    values = {f"effort_{name}_Nms": float(effort.absolute.sum()) for name, effort in efforts.items()}
    worst_deg = max(float(effort.tracking_deg.max()) for effort in efforts.values())
    return TransparencyResult(**values, tracking_error_deg=worst_deg)


TRANSPARENCY = TaskKind(
    "transparency",
    "Muscle effort of one movement in six conditions.",
    TransparencyGrid,
    TransparencyTask,
    TransparencyResult,
    ("seed",),
    each(_run),
)
