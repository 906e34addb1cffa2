"""Process of the simulated drives of one flight, which logs each command as the drives received it.

It is no process of the session: the drives of a real machine also outlive every process of the computer.
"""

import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from exograv.laboratory.options import DriveSimOptions
from exograv.laboratory.simulated_drives.drive_sim import run_drive_sim
from exograv.live.on_drives.simulated_drives import GREETING
from exograv.rig.drives.simulated.devices import SimulatedDevices
from exograv.rig.drives.udp.layout import Flag, Type
from exograv.rig.drives.udp.packets import decode
from exograv.rig.drives.udp.simulated.controller import UdpController

from .notes import write_note

KIND_AT = 5
"""Byte of a packet that is its type."""


class DrivesLog(NamedTuple):
    """Log of the simulated drives; times on CLOCK_MONOTONIC [s]. Only commands with enabled motors are in it."""

    command_t: Float[np.ndarray, " command"]
    command_current: Float[np.ndarray, "command joint"]
    """Commanded current [A]."""
    step_t: Float[np.ndarray, " step"]
    step_current: Float[np.ndarray, "step joint"]
    """Current that acted in the motor [A]."""
    step_damping: Float[np.ndarray, "step joint"]
    """Damping of the drive itself [N·m·s/rad]."""
    step_q: Float[np.ndarray, "step joint"]
    """Joint position by the encoder [rad]."""
    is_braking: Float[np.ndarray, " step"]
    """1 if each drive gave no torque and braked by itself."""
    pause_t: Float[np.ndarray, " pause"]
    """Ends of the pauses of the process of the drives itself."""
    pause_s: Float[np.ndarray, " pause"]
    """Lengths of these pauses [s]."""

    def write(self, path: Path) -> None:
        """Write the log to a file, which appears complete or not at all."""
        spare = path.with_name(f"{path.stem}.part.npz")
        np.savez(spare, **self._asdict())
        spare.replace(path)

    @classmethod
    def read(cls, path: Path) -> "DrivesLog":
        """Read a log that `write` has written."""
        with np.load(path) as file:
            return cls(*(file[name] for name in cls._fields))


class DrivesExaminer:
    """Observer of simulated drives at their bus."""

    def __init__(self):
        self._packets: list[tuple[float, bytes]] = []
        self._steps: list[tuple[float, tuple[float, ...]]] = []
        self._device: SimulatedDevices | None = None

    def examine(self, device: SimulatedDevices) -> None:
        """Observe these drives from now on."""
        assert isinstance(device, UdpController)
        self._device, receive = device, device.receive
        command, packets = int(Type.COMMAND), self._packets

        def noted(data: bytes, sender: tuple[str, int], now: float) -> bytes | None:
            if len(data) > KIND_AT and data[KIND_AT] == command:
                packets.append((now, data))
            return receive(data, sender, now)

        device.receive = noted  # type: ignore[method-assign] - the drives of this process alone are examined
        device.plant.watch = self._note_step

    def log(self) -> DrivesLog:
        """Return the observations of the drives."""
        device = self._device
        assert device is not None
        joints = len(device.plant.each)
        commands = [(t, decode(data)) for t, data in self._packets]
        enabled = [(t, packet.joints[::2]) for t, packet in commands if packet.header.flags & Flag.ENABLE]
        steps = np.array([row for _, row in self._steps]).reshape(-1, 3 * joints + 1)
        return DrivesLog(
            np.array([t for t, _ in enabled]),
            np.array([current for _, current in enabled]).reshape(-1, joints),
            np.array([t for t, _ in self._steps]),
            steps[:, :joints],
            steps[:, joints : 2 * joints],
            steps[:, 2 * joints : -1],
            steps[:, -1],
            np.array([end for end, _ in device.pauses]),
            np.array([length for _, length in device.pauses]),
        )

    def _note_step(self) -> None:
        assert self._device is not None
        plant = self._device.plant
        acts = (*(one.current for one in plant.outputs), *(one.damping for one in plant.outputs))
        is_braking = all(one.current == 0.0 and one.damping > 0.0 for one in plant.outputs)
        self._steps.append((time.monotonic(), (*acts, *plant.measured.q.tolist(), float(is_braking))))


def main(drives: str, rig: str, level: str, seed: str, log: str) -> None:
    """Serve until the input `quit`, then write the log."""
    examiner = DrivesExaminer()
    options = DriveSimOptions(rig, drives=Path(drives), level=int(level), seed=int(seed), worn=True)

    def say(line: str) -> None:
        print(line, flush=True)
        if line.startswith(GREETING):
            write_note(Path(log).parent, "drives")

    run_drive_sim(options, Path(log).parent, say, examiner.examine)
    examiner.log().write(Path(log))


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main(*sys.argv[1:])
