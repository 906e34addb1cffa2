"""Acceptance of a machine with a dummy arm (`exograv rig accept`), before the first person."""

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path

from exograv.errors import ConfigError, ExogravError
from exograv.live.options import AcceptOptions
from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import versions
from exograv.model.description import RigDescription, load_rig
from exograv.next_command import same_machine
from exograv.procedures.acceptance.dummy import Dummy, load_dummy
from exograv.procedures.acceptance.stops import STOPS
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.rig.drives.settings import load_drives
from exograv.storage.acceptance_protocol import (
    FILE,
    PAGE,
    AcceptanceKey,
    AcceptanceProtocol,
    AcceptanceRecord,
    ProtocolPart,
    protocol_part,
    read_protocol_of,
    write_protocol,
)
from exograv.storage.calibration_file import identity_of
from exograv.storage.machine_readiness import NEEDED, MachineReadiness
from exograv.storage.self_test_pass import withdraw_pass
from exograv.storage.self_test_step import Step

from .acceptance_flights import AcceptanceFlights, AcceptanceStoppedError
from .connection import CONNECTING, Say, readiness_of

IDENTIFY, WEIGH = "dummy identified, floated and verified", "known weight weighed and carried"
STOPPED = frozenset(stop.title for stop in STOPS)
BETWEEN = "between two parts"
ON_PURPOSE = "an acceptance has stopped it on purpose, or has failed"
"""Cause with which an acceptance withdraws the self-test: the stops were real ones for the machine."""


@dataclass(frozen=True)
class AcceptanceResult:
    """Result of an acceptance."""

    rig: str
    serial: str
    by: str
    simulated: bool
    ok: bool
    dummy: str
    kept: list[str]
    """Parts that were kept from an earlier call."""
    parts: list[ProtocolPart]
    protocol: Path
    page: Path
    sha256: str


def run_acceptance(options: AcceptOptions, folder: Path, progress: Progress, say: Say) -> AcceptanceResult:
    """Accept a machine with a dummy arm, and write the sealed protocol. The first failed part ends the acceptance.

    Raises:
        ConfigError: A file or an option cannot be used.
        ExogravError: The machine is not ready.
        KeyboardInterrupt: The operator has ended the acceptance; the protocol says so.
    """
    description, dummy = load_rig(options.rig, options.side), load_dummy(options.dummy)
    refuse_motorless(description)
    dummy.form_for(description)
    if options.simulated_dummy is not None:
        load_dummy(options.simulated_dummy).form_for(description)
    progress(CONNECTING, 0.0)
    readiness = _readiness(options, folder, description, say)
    walk = AcceptanceWalk(options, folder, readiness, dummy, say)
    flights = AcceptanceFlights(options, folder, readiness, dummy, progress, say)
    parts: list[tuple[str, Callable[[], list[Step]]]] = [
        (IDENTIFY, flights.identified),
        (WEIGH, flights.weighed),
        *((stop.title, partial(flights.stopped, stop)) for stop in STOPS),
    ]
    return walk.run(parts)


def _readiness(options: AcceptOptions, folder: Path, description: RigDescription, say: Say) -> MachineReadiness:
    """Check the machine, before anything moves."""
    with tempfile.TemporaryDirectory() as spare:
        drives = load_drives(options.drives or written(Path(spare), description), description)
    readiness = readiness_of(options, folder, description, drives)
    readiness.refuse(NEEDED["rig accept"], say)
    return readiness


class AcceptanceWalk:
    """Walk through the parts of an acceptance. The protocol is written after each part."""

    def __init__(self, options: AcceptOptions, folder: Path, readiness: MachineReadiness, dummy: Dummy, say: Say):
        """Begin a protocol, or take up an earlier one with `--resume`.

        Raises:
            ConfigError: The earlier protocol cannot be resumed.
        """
        self._options, self._folder, self._readiness, self._say = options, folder, readiness, say
        self._begun = datetime.now().astimezone().replace(microsecond=0)
        self._key = AcceptanceKey(
            drives_sha256="" if options.drives is None else readiness.drives.sha256,
            calibration_sha256=readiness.calibration().whole.content_sha256,
            dummy=dummy.settings.name,
            dummy_sha256=dummy.sha256,
            code_sha256=versions()["code"],
            is_simulated=options.simulate,
        )
        self._has_stopped = False
        self._parts: list[ProtocolPart] = []
        if options.resume:
            self._parts = self._earlier()
        self._kept = [part.name for part in self._parts]
        self._again = same_machine("rig accept", options, folder, "--resume")

    def run(self, parts: list[tuple[str, Callable[[], list[Step]]]]) -> AcceptanceResult:
        """Run the parts that have not passed. The first failed part ends the acceptance.

        Raises:
            KeyboardInterrupt: The operator has ended the acceptance.
        """
        try:
            for number, (name, act) in enumerate(parts):
                if name in self._kept:
                    continue
                self._say(f"Part {number + 1} of {len(parts)}: {name}.")
                self._has_stopped = self._has_stopped or name in STOPPED
                if not self._flown(name, act).passed:
                    self._has_stopped = True
                    return self._result(self._write("failed"))
                if number + 1 < len(parts):
                    self._write("aborted", BETWEEN)
            return self._result(self._write("passed"))
        finally:
            if self._has_stopped:
                withdraw_pass(self._readiness.key.file, ON_PURPOSE)

    def _flown(self, name: str, act: Callable[[], list[Step]]) -> ProtocolPart:
        begun = time.monotonic()
        try:
            steps = _tried(name, act)
        except KeyboardInterrupt:
            self._write("aborted", name)
            self._say(
                f"The acceptance was aborted in the part “{name}”, and {self._folder / FILE} says so. No part failed. "
                f"Go on with `{self._again}`."
            )
            raise
        now, recordings = datetime.now().astimezone(), str(self._folder / "acceptance")
        self._parts.append(protocol_part(name, now, time.monotonic() - begun, recordings, steps))
        return self._parts[-1]

    def _earlier(self) -> list[ProtocolPart]:
        anew = f"Begin anew: `{same_machine('rig accept', self._options, self._folder)}`."
        readiness = self._readiness
        whole = read_protocol_of(self._folder / FILE, readiness.description, readiness.serial, anew)
        if whole.key != self._key:
            raise ConfigError(
                f"{self._folder / FILE} belongs to another drives.toml, calibration, dummy or exograv, so it cannot be "
                f"resumed. {anew}"
            )
        self._begun = whole.done.begun
        return [part for part in whole.parts if part.passed]

    def _write(self, state: str, aborted_at: str = "") -> AcceptanceProtocol:
        readiness = self._readiness
        done = AcceptanceRecord.model_validate(
            {
                "by": self._options.by,
                "begun": self._begun,
                "written": datetime.now().astimezone().replace(microsecond=0),
                "state": state,
                "aborted_at": aborted_at,
                "versions": versions(),
            }
        )
        whole = AcceptanceProtocol(
            identity=identity_of(readiness.description, readiness.serial), key=self._key, done=done, parts=self._parts
        )
        return write_protocol(self._folder, whole)

    def _result(self, whole: AcceptanceProtocol) -> AcceptanceResult:
        return AcceptanceResult(
            rig=self._readiness.description.name,
            serial=self._readiness.serial,
            by=self._options.by,
            simulated=self._options.simulate,
            ok=whole.done.state == "passed",
            dummy=whole.key.dummy,
            kept=self._kept,
            parts=whole.parts,
            protocol=self._folder / FILE,
            page=self._folder / PAGE,
            sha256=whole.content_sha256,
        )


def _tried(name: str, act: Callable[[], list[Step]]) -> list[Step]:
    """Return the steps of a part; a part that cannot be flown has failed, with its reason."""
    try:
        return act()
    except AcceptanceStoppedError as stopped:
        raise KeyboardInterrupt from stopped
    except ExogravError as error:
        return [Step(name, False, "not flown", "flown", "", str(error))]
