"""A machine that is reached over its bus: opened, and let go of by whatever way a session ends."""

import contextlib
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError
from exograv.loop.pilot import Pilot, Progress
from exograv.model.description import RigDescription
from exograv.options import MachineOptions
from exograv.procedures.bring_up.hands import BenchHands, Hands, KeyboardHands
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.rig.drives.opening import DrivenRig, open_drives
from exograv.rig.drives.settings import Drives, load_drives
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.envelope import Envelope, Limits

from .simulated_drives import simulated_drives

Say = Callable[[str], object]


def serial_of(options: MachineOptions, drives: Drives) -> str:
    """Serial number to which calibration and self-test belong; that of simulated drives is never a real one's."""
    own = drives.settings.serial
    return f"{own}, simulated, level {options.level}, seed {options.seed}" if options.simulate else own


@dataclass(frozen=True)
class Connected:
    """A machine whose drives answer; none is switched on yet."""

    rig: DrivenRig
    drives: Drives
    hands: Hands
    serial: str
    lock_step: bool

    def pilot(self, actuators: ActuatorGain, limits: Limits, progress: Progress) -> Pilot:
        """Flies it, at its own pace."""
        pace = None if self.lock_step else RealTimePace(self.rig.period_s)
        return Pilot(self.rig, actuators, Envelope(limits, self.rig.period_s), progress=progress, pace=pace)


@contextlib.contextmanager
def drives_with_hands(
    options: MachineOptions,
    description: RigDescription,
    say: Say,
    what: str,
    simulation: tuple[str, ...] = (),
    in_real_time: bool = False,
) -> Iterator[tuple[Drives, Hands]]:
    """Somebody at the keyboard, or at the bench of simulated drives, which begin.

    Args:
        options: Which drives, and which twin is behind simulated ones.
        description: Of the machine.
        say: Shows a line to whoever stands at a real machine.
        what: Needs the hands; for the error.
        simulation: More options of `exograv drive-sim`.
        in_real_time: True if simulated drives have a clock of their own, instead of waiting for this process.

    Raises:
        ConfigError: The file cannot be used, or nobody is at the keyboard.
        RigError: The simulated drives do not begin.
    """
    with tempfile.TemporaryDirectory() as spare:
        path = options.drives or written(Path(spare), description)
        drives = load_drives(path, description)
        if not options.simulate:
            if not sys.stdin.isatty():
                raise ConfigError(f"{what} needs somebody at the keyboard: run it in a terminal, or with --simulate.")
            yield drives, KeyboardHands(say)
            return
        told = ["--drives", str(path), "--rig", str(description.folder), "--side", description.side]
        twin = ["--level", str(options.level), "--seed", str(options.seed)]
        clock = [] if in_real_time else ["--lock-step"]
        with simulated_drives(drives.settings.bus, [*told, *twin, *clock, *simulation]) as tell:
            yield drives, BenchHands(tell)


@contextlib.contextmanager
def connected(options: MachineOptions, description: RigDescription, say: Say, what: str) -> Iterator[Connected]:
    """The same, and the bus is opened.

    Raises:
        ConfigError: As above.
        RigError: A drive does not answer, or is not the one in the file.
    """
    with (
        drives_with_hands(options, description, say, what) as (drives, hands),
        open_drives(drives, options.simulate) as rig,
    ):
        yield Connected(rig, drives, hands, serial_of(options, drives), options.simulate)
