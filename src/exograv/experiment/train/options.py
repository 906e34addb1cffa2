"""Options of a session of a protocol."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.options import (
    ON_DRIVES,
    ON_SIMULATED,
    ON_TWIN,
    RIG_HELP,
    SESSIONS_MAX,
    Acts,
    DerivedMachine,
    Donning,
    OneSideOption,
    OptionRecord,
    PersonCode,
    Seed,
    StreamNames,
    TwinSource,
    Within,
    WornOptions,
    foreign_world,
)

IN_LOCK_STEP = Acts(
    lambda all_: not all_.is_on_drives or all_.virtual_clock, "on the twin, or on simulated drives with --virtual-clock"
)


AT_TERMINAL = Acts(lambda all_: all_.is_on_drives and not all_.virtual_clock, "on drives, without --virtual-clock")


@dataclass(frozen=True)
class TrainOptions(WornOptions):
    """Options of `exograv run train`."""

    protocol: str = "training"
    """Protocol: `training`, `familiarisation`, `flight`, or the path of your own protocol."""

    # '_' is not allowed, because it separates the parts of the files' names.
    participant: Annotated[str, PersonCode("Give the code that stands for the person, such as P-07.", "+-")] = ""
    """Code of the person, such as P-07, never a name."""

    session: Annotated[int, Within(1, SESSIONS_MAX)] = 1
    """Number of the session with this protocol for this person. It is part of the files' names."""

    rig: Annotated[  # pyright: ignore[reportIncompatibleVariableOverride] - its default depends on the protocol
        DerivedMachine, tyro.conf.arg(help=f"{RIG_HELP} Default: recupera_like, in flight its passive version.")
    ] = None

    virtual_clock: Annotated[bool, Acts(lambda all_: all_.simulate, "with --simulate")] = False
    """Run simulated drives and a virtual participant, in another process, in lock-step with this one: no operator, no
    page, faster than real time."""

    real_time: Annotated[
        bool, Acts(lambda all_: all_.simulate and not all_.virtual_clock, "with --simulate, without --virtual-clock")
    ] = False

    stimulus: Annotated[
        int | None, Within(1024, 65535), tyro.conf.arg(metavar="PORT"),
        Acts(lambda all_: all_.simulate and not all_.virtual_clock, "with --simulate, without --virtual-clock"),
    ] = None  # fmt: skip
    """Seat a virtual participant in the simulated machine, who waits at this TCP port for `exograv dev stimulus`: that
    process shows it the participant's page, and makes its touches there."""

    side: OneSideOption = None
    twin: Annotated[TwinSource, ON_SIMULATED] = "drawn"
    seed: Annotated[Seed, Within(0, 2**31), ON_SIMULATED] = 0
    donning: Annotated[Donning, ON_SIMULATED] = 0
    calibration: Path | None = None
    """File calibration.toml of this machine. Without it the twin is calibrated first; on drives it is the file in the
    folder of --out."""

    participants: Annotated[Path | None, ON_DRIVES] = None
    """Folder of the participants' files; by default `participants` in the folder of --out. A person with a file is only
    checked, in 20 s instead of 60."""

    person_file: Annotated[Path | None, ON_TWIN] = None
    """File of this person's arm. The identification starts from it and writes it."""

    allocation: Path | None = None
    """Sealed list of groups of the study (JSON)."""

    windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Run only the first N windows, for a trial. The recording states that it is not the whole protocol."""

    aircraft_file: Annotated[Path | None, ON_TWIN] = None
    """Flight that a sensor recorded (`exograv data aircraft replay`), for a protocol whose windows an aircraft opens.
    The file must name its columns and units."""

    verify_every: Annotated[int, tyro.conf.arg(metavar="N"), Within(0, 500), ON_TWIN] = 0
    """Verify the residual torque after every N windows, with 138 s of motion each time; 0 for never."""

    check_every: Annotated[int, tyro.conf.arg(metavar="N"), Within(0, 500), IN_LOCK_STEP] = 0
    """Compare the arm with its identification after every N windows, with 20 s of motion each time; 0 for never. A cuff
    that has moved, drives that are warm and an arm that is not relaxed are told with their size."""

    identify_again: Annotated[bool, Acts(lambda all_: all_.check_every, "with --check-every")] = False
    """Identify the arm again by the motion of a check that finds a change."""

    learn_in_rests: bool = False
    """Move the relaxed arm for 10 s in each rest, learn it, and carry the new arm where it is more certain. In
    lock-step the session begins without identification, with the arm of the table or of the person's file; on drives it
    begins with the identification, and the operator presses Enter in each rest."""

    emg: Annotated[
        bool,
        Acts(lambda all_: all_.learn_in_rests and not all_.is_on_drives, "on the twin, with --learn-in-rests"),
    ] = False
    """Measure the muscles of the twin's wearer by EMG, so that the rests of a wearer who does not relax teach, too."""

    whole_rests: Annotated[bool, ON_TWIN] = False
    """Simulate each tick of the rests. Without it the twin's clock and the warm-up of its drives pass while the arm
    lies on its support, and the recording has no ticks of that time."""

    resume: bool = False
    """Continue an interrupted run at the next window."""

    lsl: bool = False
    """Publish markers over Lab Streaming Layer, on drives also joint state and torque. On the twin and a virtual clock
    the markers have the computer's time."""

    record_streams: Annotated[StreamNames, AT_TERMINAL] = ()
    """Record the stream of another device with this name, or all streams of this type. Can be repeated. See `exograv
    data streams`."""

    @property
    def name(self) -> str:
        """Name of all files of this session, without suffix. A trial with `--windows` blocks no session."""
        part = "" if self.windows is None else f"-first-{self.windows}"
        return f"{self.participant}_{Path(self.protocol).stem}{part}_{self.session:02d}"

    @property
    def kept(self) -> OptionRecord:
        """Options that must be the same when a run is continued."""
        clock: OptionRecord = {"virtual_clock": True} if self.virtual_clock else {}
        rests: OptionRecord = {"learn_in_rests": True} if self.learn_in_rests else {}
        flight: OptionRecord = {} if self.aircraft_file is None else {"aircraft_file": str(self.aircraft_file)}
        fitted: OptionRecord = {} if self.twin == "drawn" else {"twin": self.twin}
        emg: OptionRecord = {"emg": True} if self.emg else {}
        return foreign_world(self.world) | fitted | clock | rests | emg | flight | {
            "protocol": self.protocol, "participant": self.participant, "session": self.session, "rig": self.rig,
            "side": self.side, "level": self.level, "seed": self.seed,
            "donning": self.donning, "windows": self.windows,
            "allocation": None if self.allocation is None else str(self.allocation),
        }  # fmt: skip
