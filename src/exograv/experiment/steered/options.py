"""Options of a session that pages steer."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol, runtime_checkable

import tyro

from exograv.options import (
    ON_SIMULATED,
    Acts,
    Donning,
    Level,
    Loss,
    PersonCode,
    Seed,
    StreamNames,
    Within,
    World,
    WornOptions,
)
from exograv.results import json_value
from exograv.storage.rests_so_far import NO_RESTS, RestsSoFar

if TYPE_CHECKING:
    from exograv.task.run_statement import RunStatement  # NumPy: the command line starts without it

MOVED = Acts(lambda all_: not getattr(all_, "rehearse", False), "on a machine, without --rehearse")


@runtime_checkable
class StatesRun(Protocol):
    """Run of a protocol that states itself, such as `storage.stated_run.StatedRun`."""

    def now(self) -> "RunStatement":
        """Return the statement at the present moment."""
        ...


@dataclass(frozen=True)
class SteeredOptions(WornOptions):
    """Options of a steered session on the twin or on drives."""

    level: Annotated[Level, MOVED, ON_SIMULATED] = 2
    world: Annotated[World, MOVED, ON_SIMULATED] = "home"
    seed: Annotated[Seed, MOVED, ON_SIMULATED] = 0
    donning: Annotated[Donning, MOVED, ON_SIMULATED] = 0

    calibration: Annotated[Path | None, MOVED] = None
    """File calibration.toml of this machine.

    Without it the twin is calibrated at the start, which takes a minute; on drives it is the file in the folder of
    --out.
    """

    participants: Annotated[Path | None, MOVED] = None
    """Folder of participant files. A known arm is only checked, in 20 s instead of 60. New arms are written there."""

    participant: Annotated[str | None, PersonCode()] = None
    """Code of the person in the machine at the start, such as P-07, never a name."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S"), MOVED] = 60.0
    """Duration of the motion that identifies an unknown person."""

    session_s: Annotated[tyro.conf.Fixed[float], Within(60.0, 7200.0)] = 3600.0
    """Longest recording [s]."""

    lsl: Annotated[bool, MOVED] = False
    """Publish joint state, torque and markers over Lab Streaming Layer, from the recorder's process."""

    record_streams: Annotated[StreamNames, MOVED] = ()
    """Record the stream of another device with this name, or all streams of this type. Can be repeated. See `exograv
    data streams`."""

    stimulus: tyro.conf.Fixed[int | None] = None
    """TCP port of a virtual participant in a simulated machine; None for a relaxed wearer."""

    protocol_of_stimulus: tyro.conf.Fixed[str] = "training"
    """Protocol whose target the virtual participant knows."""

    run: tyro.conf.Fixed[StatesRun | None] = None
    """Run of a protocol, which each recording states; None without one."""

    rests: tyro.conf.Fixed[RestsSoFar] = NO_RESTS
    """Rests before the interruption of the session that is resumed; none for a new session."""

    windows: tyro.conf.Fixed[int | None] = None
    """Number of windows of a trial; None for a whole protocol."""

    allocation_sha256: tyro.conf.Fixed[str | None] = None
    """Hash of the study's list of groups; None without one."""

    on_loss: Annotated[Loss, MOVED] = "finish"
    """Action on an open window when the operator's page is lost."""

    def written(self) -> dict[str, Any]:
        """Options for the recording."""
        return {
            name: str(value) if isinstance(value, Path) else value
            for name, value in asdict(self).items()
            if name not in ("drives", "simulate", "run", "rests")
        }

    def stated(self) -> Mapping[str, Any]:
        """Return the settings that name the run of a recording, for a study; empty without a run."""
        return {} if self.run is None else {"run": json_value(self.run.now())}
