"""Generated `drives.toml` of simulated drives, from the data sheets of a machine."""

import tempfile
from pathlib import Path
from typing import Any

from exograv.files import toml_text
from exograv.loop.machine_limits import DAMPING
from exograv.model.description import RigDescription
from exograv.rig.drives.simulated.address import free_port

RATED_SHARE = 1.0 / 3.0  # continuous current as a share of the peak current, as in examples/drives

HEAD = "# Simulated drives, written by exograv for `exograv dev drive-sim` and its clients.\n\n"
COUNTS_PER_TURN, GEAR = 2**20, 25
"""Encoder resolution and gear ratio of simulated CAN drives. The encoders are fine enough that the twin's own
resolution dominates."""


def drives_of(description: RigDescription, port: int, bus: str = "udp", has_motor_encoders: bool = True) -> str:
    """Return a `drives.toml` of simulated drives for any machine, with current limits from its data sheets.

    Simulated machines on one computer need different ports.
    """
    most = description.per_actuator("torque_max_Nm") / description.nominal_gain
    counts = {"counts_per_turn": COUNTS_PER_TURN}
    if has_motor_encoders:
        counts["motor_counts_per_turn"] = GEAR * COUNTS_PER_TURN
    drives = [
        {
            "joint": joint,
            "node": node,
            "current_rated_A": float(f"{RATED_SHARE * current:.4g}"),
            "current_max_A": float(f"{current:.4g}"),
            "brake_Nms_per_rad": DAMPING[place],
            **(counts if bus == "canopen" else {}),
        }
        for node, (joint, current, place) in enumerate(
            zip(description.joints, most, description.places, strict=True), start=1
        )
    ]
    head = {"schema_version": 1, "rig": description.name, "serial": "simulated"}
    return toml_text({**head, **_bus_tables(bus, port), "drives": drives}, HEAD)


def _bus_tables(bus: str, port: int) -> dict[str, Any]:
    if bus == "canopen":
        channel = f"239.74.163.2:{port}"
        return {"period_ms": 2, "canopen": {"interface": "udp_multicast", "channel": channel}}
    if bus == "moteus":
        return {"period_ms": 2, "moteus": {"path": f"{tempfile.gettempdir()}/exograv_fdcanusb_{port}"}}
    return {"udp": {"port": port}}


def written(folder: Path, description: RigDescription, bus: str = "udp", has_motor_encoders: bool = True) -> Path:
    """Write `drives.toml` of this machine to a folder, with a free port, and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "drives.toml"
    path.write_text(drives_of(description, free_port(), bus, has_motor_encoders), encoding="utf-8")
    return path
