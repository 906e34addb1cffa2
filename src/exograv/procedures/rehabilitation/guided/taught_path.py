"""A taught path as a file: small, sealed, of one machine and one person's code, never of a name."""

from datetime import datetime
from pathlib import Path
from typing import ClassVar

import numpy as np
from pydantic import Field

from exograv.errors import ConfigError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription
from exograv.motion import Trajectory
from exograv.options import Side
from exograv.storage.sealed_file import Sealed, read_sealed, sealed, write_sealed

from .path_shaping import PERIOD_S, ShapedPath, driven, refuse_outside, refuse_quick

HEAD = """# A path along which a therapist led an arm: `exograv repeat` leads the same person's arm along it. It belongs
# to this machine and side. Do not edit: the hash at its head would not fit any more. Teach it again instead.
"""


class TaughtPath(Sealed):
    """What is kept of a path."""

    VERSION: ClassVar[int] = 1
    schema_version: int = 1
    rig: str
    side: Side
    rig_sha256: str
    code: str = ""
    """The person's, where one was given."""
    taught_at: datetime
    is_simulated: bool
    period_s: float = Field(gt=0.0, le=0.1)
    stretched: float = Field(ge=1.0)
    """Its time over the therapist's."""
    joints: list[str]
    q_rad: list[list[float]] = Field(min_length=3, max_length=20_000)

    def trajectory(self, dt: float) -> Trajectory:
        """The path, from rest to rest, at the loop's period."""
        return driven(np.array(self.q_rad), self.period_s, dt)


def make_taught_path(
    path: ShapedPath, description: RigDescription, code: str, at: datetime, is_simulated: bool
) -> TaughtPath:
    """What to keep, with its hash."""
    return sealed(
        TaughtPath(
            rig=description.name,
            side=description.side,
            rig_sha256=description.sha256,
            code=code,
            taught_at=at,
            is_simulated=is_simulated,
            period_s=PERIOD_S,
            stretched=path.stretched,
            joints=list(description.joints),
            q_rad=path.q.round(5).tolist(),
        )
    )


def write_taught(path: Path, whole: TaughtPath) -> None:
    """Write the file, or leave the old one as it was.

    Raises:
        ConfigError: The place cannot be written.
    """
    write_sealed(path, whole, HEAD, "--path")


def read_taught(path: Path, description: RigDescription, code: str | None) -> TaughtPath:
    """Read a path for this machine.

    Raises:
        ConfigError: It is damaged, of another machine or side, or of somebody else; or it leaves what is allowed now.
    """
    whole = read_sealed(path, TaughtPath, "Give the file that `exograv teach` wrote.", "Teach the path again.")
    if (whole.rig, whole.side) != (description.name, description.side):
        raise ConfigError(
            f"{path} was taught on {whole.rig}, {whole.side} side; this is {description.name}, {description.side}. "
            "Give --rig and --side as they were taught, or teach it again here."
        )
    if whole.rig_sha256 != description.sha256:
        raise ConfigError(f"{description.name} was changed since {path} was taught. Teach the path again.")
    if whole.joints != list(description.joints) or any(len(row) != len(whole.joints) for row in whole.q_rad):
        raise ConfigError(f"{path} is not of the joints {', '.join(description.joints)}. Teach the path again.")
    if whole.code and code is None:
        raise ConfigError(f"{path} is of a person with a code. Give the code of whoever is in the machine with --code.")
    if code is not None and code != whole.code:
        raise ConfigError(f"{path} is not of the person with this code. Give that person's own path, or teach one.")
    # What was allowed when it was taught may be so no more, and a hash proves no limits.
    exo, q = read_exoskeleton(description), np.array(whole.q_rad)
    refuse_outside(q, np.arange(len(q)) * whole.period_s, description, exo)
    refuse_quick(whole.trajectory(whole.period_s), description, exo)
    return whole
