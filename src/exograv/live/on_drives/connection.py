"""Connection to a machine over its bus, which is released however a session ends."""

import contextlib
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError
from exograv.loop.pilot import Pilot, Progress
from exograv.model.description import RigDescription
from exograv.options import CalibratedOptions, MachineOptions
from exograv.procedures.bring_up.hands import BenchHands, Hands, KeyboardHands
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.recording import RecordingWriter
from exograv.rig.drives.opening import DrivenRig, open_drives
from exograv.rig.drives.settings import Drives, load_drives
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.storage.machine_readiness import NEEDED, MachineReadiness, serial_of

from .simulated_drives import simulated_drives

Say = Callable[[str], object]
"""Function that shows a line to the operator."""


CONNECTING = "Connecting to the drives"
"""Phase in which the bus is opened, and simulated drives are started."""


@dataclass(frozen=True)
class Connected:
    """Machine whose drives answer. No drive is enabled yet."""

    rig: DrivenRig
    drives: Drives
    hands: Hands
    serial: str
    lock_step: bool

    def pilot(
        self, actuators: ActuatorGain, limits: Limits, progress: Progress, recording: RecordingWriter | None = None
    ) -> Pilot:
        """Return a pilot of the machine: in lock-step, or in real time."""
        pace = None if self.lock_step else RealTimePace(self.rig.period_s)
        return Pilot(self.rig, actuators, Envelope(limits, self.rig.period_s), recording, progress, pace)


Refuse = Callable[[Drives], object]
"""Function that checks a machine before its bus is opened and before simulated drives start, such as `not_ready`."""


@contextlib.contextmanager
def drives_with_hands(
    options: MachineOptions,
    description: RigDescription,
    say: Say,
    what: str,
    simulation: tuple[str, ...] = (),
    in_real_time: bool = False,
    refuse: Refuse = lambda _: None,
) -> Iterator[tuple[Drives, Hands]]:
    """Read the drives and yield them with the hands of an operator: at the keyboard, or simulated.

    Args:
        options: Choice of the drives, and of the twin behind simulated drives.
        description: Description of the machine.
        say: Function that shows a line to the operator of a real machine.
        what: Subject of the error message: the procedure that needs the operator.
        simulation: Further options of `exograv dev drive-sim`.
        in_real_time: As in `drives_of`.
        refuse: As in `drives_of`.

    Raises:
        ConfigError: The file cannot be used, or standard input is not a terminal.
        RigError: The simulated drives do not start.
        ExogravError: The machine was refused.
    """
    with drives_of(options, description, simulation, in_real_time, refuse) as (drives, tell):
        if tell is None and not sys.stdin.isatty():
            raise ConfigError(f"{what} needs an operator at the keyboard: run it in a terminal, or with --simulate.")
        yield drives, KeyboardHands(say) if tell is None else BenchHands(tell)


@contextlib.contextmanager
def drives_of(
    options: MachineOptions,
    description: RigDescription,
    simulation: tuple[str, ...] = (),
    in_real_time: bool = False,
    refuse: Refuse = lambda _: None,
) -> Iterator[tuple[Drives, Callable[[str], None] | None]]:
    """Read the drives of a machine; simulated drives are started in another process, with their bench beside them.

    Args:
        options: Choice of the drives, and of the twin behind simulated drives.
        description: Description of the machine.
        simulation: Further options of `exograv dev drive-sim`.
        in_real_time: True if simulated drives have a clock of their own, instead of waiting for this process.
        refuse: Check of the machine before anything is opened or started.

    Raises:
        ConfigError: The file cannot be used.
        RigError: The simulated drives do not start.
        ExogravError: The machine was refused.
    """
    with tempfile.TemporaryDirectory() as spare:
        path = options.drives or written(Path(spare), description)
        drives = load_drives(path, description)
        refuse(drives)
        if not options.simulate:
            yield drives, None
            return
        told = ["--drives", str(path), "--rig", str(description.folder), "--side", description.side]
        twin = ["--level", str(options.level), "--seed", str(options.seed), "--world", options.world]
        twin += [] if options.twin == "drawn" else ["--twin", options.twin]
        clock = [] if in_real_time else ["--lock-step"]
        with simulated_drives(drives.settings.bus, [*told, *twin, *clock, *simulation]) as tell:
            yield drives, tell


def drawn_by(options: MachineOptions) -> Mapping[str, Any]:
    """Return what a recording states about simulated drives, so that no reader takes it for one of a person."""
    if not options.simulate:
        return {}
    return {"disturbance_level": options.level, "world": options.world, "seed": options.seed}


def readiness_of(
    options: CalibratedOptions, folder: Path, description: RigDescription, drives: Drives
) -> MachineReadiness:
    """Return the checks of this machine at the present time."""
    return MachineReadiness(options, folder, description, drives, datetime.now().astimezone())


def not_ready(options: CalibratedOptions, folder: Path, description: RigDescription, command: str, say: Say) -> Refuse:
    """Return the function that refuses a machine which is not ready for a command; `say` then shows the checklist."""
    return lambda drives: readiness_of(options, folder, description, drives).refuse(NEEDED[command], say)


@contextlib.contextmanager
def connected(
    options: MachineOptions,
    description: RigDescription,
    say: Say,
    what: str,
    refuse: Refuse,
    simulation: tuple[str, ...] = (),
) -> Iterator[Connected]:
    """Read the drives as `drives_with_hands` and open the bus.

    Raises:
        ConfigError: As `drives_with_hands`.
        RigError: A drive does not answer, or is not the drive in the file.
    """
    with (
        drives_with_hands(options, description, say, what, simulation, refuse=refuse) as (drives, hands),
        open_drives(drives, options.simulate) as rig,
    ):
        yield Connected(rig, drives, hands, serial_of(options, drives), options.simulate)
