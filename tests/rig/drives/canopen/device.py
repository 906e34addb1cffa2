"""Simulated drives of `recupera_like` in a process of their own; commands by lines, JSON back.

python device.py DRIVES.toml [lock-step] [without=0x2100] [wrong-sign=JOINT]
"""

import json
import select
import sys
from pathlib import Path

from exograv.model.description import load_rig
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.canopen.simulated.network import CanopenDevices
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated import Plant, Wiring
from exograv.rig.twin import Disturbances, Twin, draw_machine

SEED = 1000


def state(devices: CanopenDevices) -> dict:
    """State by the drives' own report, one entry per joint."""
    each = devices.plant.each
    return {
        "now": devices.plant.now,
        "q": devices.plant.measured.q.tolist(),
        "enabled": [drive.is_enabled for drive in each],
        "fault": [int(drive.fault) for drive in each],
        "silence_s": [drive.silence_s for drive in each],
        "watchdog_s": [drive.watchdog_s for drive in each],
        "brakes": devices.plant.twin.drive_damping().tolist(),
        "operational": [node.is_operational for node in devices.nodes],
        "pauses": devices.pauses,
    }


def obey(devices: CanopenDevices, joints: tuple[str, ...], words: list[str]) -> None:
    """Execute one line of the test."""
    name, *rest = words
    if name in ("unplug", "plug", "restart"):
        getattr(devices, name)(joints.index(rest[0]))
    elif name == "fail":
        devices.plant.each[joints.index(rest[0])].fail(DriveFault[rest[1]])
    elif name == "heat":
        devices.plant.each[joints.index(rest[0])].temperature_C = float(rest[1])
    elif name == "press":
        devices.plant.press_stop()
    elif name == "release":
        devices.plant.release_stop()


def main() -> None:
    """Serve until the line ends."""
    options = dict(word.split("=") for word in sys.argv[2:] if "=" in word)
    description = load_rig("recupera_like")
    drives = load_drives(Path(sys.argv[1]), description)
    wiring = {options["wrong-sign"]: Wiring(current=-1.0)} if "wrong-sign" in options else {}
    without = frozenset(int(index, 16) for index in options.get("without", "").split(",") if index)
    twin = Twin(description, draw_machine(description, Disturbances.at_level(0), SEED), None, SEED)
    plant = Plant(twin, drives, wiring)
    devices = CanopenDevices(plant, drives, "lock-step" in sys.argv, lambda line: None, without)

    def until_stopped() -> bool:
        if not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        words = sys.stdin.readline().split()
        if words:
            obey(devices, drives.joints, words)
            print(json.dumps(state(devices)), flush=True)
        return not words

    with devices:
        print("ready", flush=True)
        devices.run(until_stopped)


if __name__ == "__main__":
    main()
