"""Options of a session of a protocol."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.options import (
    SESSIONS_MAX,
    CalibrationFile,
    Donning,
    Level,
    OneSideOption,
    OptionRecord,
    Options,
    PersonCode,
    Seed,
    Within,
)


@dataclass(frozen=True)
class TrainOptions(Options):
    """Options of `exograv run train`."""

    protocol: str = "training"
    """`training`, `familiarisation`, `flight`, or the path of a protocol of your own."""

    # No '_', which separates the parts of the files' names.
    participant: Annotated[str, PersonCode("Give the code that stands for the person, such as P-07.", "+-")] = ""
    """Code that stands for the person, such as P-07, never a name."""

    session: Annotated[int, Within(1, SESSIONS_MAX)] = 1
    """Which one of this protocol it is for this person; it names the files."""

    rig: str | None = None
    """Name of a machine (see `exograv rigs`) or path of its folder; `recupera_like`, in flight its passive sister."""

    side: OneSideOption = None
    level: Level = 2
    seed: Annotated[Seed, Within(0, 2**31)] = 0
    donning: Donning = 0
    calibration: CalibrationFile = None

    person_file: Path | None = None
    """File of this person's arm: started from where it is there, written after the identification."""

    allocation: Path | None = None
    """The study's sealed list of groups (JSON)."""

    windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only so many, to try it; the record then says that it is not the protocol."""

    verify_every: Annotated[int, tyro.conf.arg(metavar="N"), Within(0, 500)] = 0
    """Verify after so many windows what is left over, 138 s of motion each time; 0 never."""

    resume: bool = False
    """Go on with a run that was broken off, at the next window."""

    lsl: bool = False
    """Push every record as a marker into Lab Streaming Layer, stamped with the moment and not with the twin's clock."""

    @property
    def name(self) -> str:
        """Of all files of this session, without ending."""
        protocol = Path(self.protocol).stem
        return f"{self.participant}_{protocol}_{self.session:02d}"

    @property
    def kept(self) -> OptionRecord:
        """What has to be the same when a run is gone on with."""
        return {
            "protocol": self.protocol, "participant": self.participant, "session": self.session, "rig": self.rig,
            "side": self.side, "level": self.level, "seed": self.seed, "donning": self.donning,
            "windows": self.windows, "allocation": None if self.allocation is None else str(self.allocation),
        }  # fmt: skip
