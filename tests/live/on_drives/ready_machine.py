"""Machine on simulated drives that is ready for a person, without the flights of a calibration and a self-test.

The calibration holds the data sheets. At disturbance level 0 the machine is that of its data sheets.
"""

import json
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from exograv.identification.calibration.empty_machine import Calibration
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.options import MachineOptions
from exograv.procedures.bring_up.simulated_drives_file import drives_of
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated.address import free_port
from exograv.storage.calibration_file import identity_of, write_calibration
from exograv.storage.calibration_schema import MeasurementConditions, stored
from exograv.storage.machine_readiness import serial_of
from exograv.storage.self_test_pass import MachineKey, write_pass

SEED, LEVEL, PERIOD_MS = 1022, 0, 4
"""The longest period is the quickest: these flights are about steps and endings, not about timing."""

RESIDUAL_NM, CORRELATION_S = 0.1, 0.3
"""Residual torque of a machine as calibrated."""


@dataclass(frozen=True)
class ReadyMachine:
    """Folder with drives, calibration and self-test of a simulated machine."""

    folder: Path
    rig: str

    @classmethod
    def made(cls, folder: Path, rig: str) -> "ReadyMachine":
        """Write the files of a machine."""
        description = load_rig(rig)
        drives = folder / "udp.toml"
        text = f"period_ms = {PERIOD_MS}\nwatchdog_ms = 30.0\n{drives_of(description, free_port())}"
        drives.write_text(text, encoding="utf-8")
        options = MachineOptions(rig=rig, drives=drives, simulate=True, level=LEVEL, seed=SEED)
        serial = serial_of(options, load_drives(drives, description))
        n = len(description.joints)
        phi = read_exoskeleton(description).phi
        nominal = nominal_machine(description, phi)
        machine = type(nominal)(
            **{**vars(nominal), "residual_sd": np.full(n, RESIDUAL_NM), "correlation_s": np.full(n, CORRELATION_S)}
        )
        small = np.full(n, 0.001)
        found = Calibration(machine, np.zeros(2), small[:2], small, small, 0.01 * np.abs(phi))
        now = datetime.now(UTC).replace(microsecond=0)
        when = MeasurementConditions(
            at_utc=now, friction_at_utc=now, running_s=300.0, lengths_m=settings_of_lengths(description, ())
        )
        whole = stored(found, identity_of(description, serial), when, description.joints)
        (folder / "out").mkdir()
        write_calibration(folder / "out" / "calibration.toml", whole)
        key = MachineKey(folder / "out" / "self_test.toml", description, serial, whole.content_sha256)
        write_pass(key, datetime.now().astimezone())
        return cls(folder, rig)

    def command(self, *words: str) -> list[str]:
        """Return a command of `exograv` on this machine."""
        machine = ["--simulate", "--drives", "udp.toml", "--level", str(LEVEL), "--seed", str(SEED)]
        return [sys.executable, "-m", "exograv.cli", *words, *machine, "--json", "figures.json"]

    def flown(self, *words: str) -> dict[str, Any]:
        """Run a command to its end, and return its figures."""
        process = subprocess.run(
            self.command(*words), cwd=self.folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, check=False,
        )  # fmt: skip
        assert process.returncode == 0, process.stdout
        return json.loads((self.folder / "figures.json").read_text(encoding="utf-8"))

    def replayed(self, recording: Path) -> str:
        """Replay a recording and return the output."""
        command = [sys.executable, "-m", "exograv.cli", "data", "replay", str(recording), "--out", "replay"]
        process = subprocess.run(command, cwd=self.folder, text=True, capture_output=True, check=False)
        return process.stdout + process.stderr
