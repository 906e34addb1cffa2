"""The drives.toml of simulated drives, made from a machine's data sheets."""

import tempfile
from pathlib import Path

from exograv.loop.machine_limits import DAMPING
from exograv.model.description import RigDescription
from exograv.rig.drives.simulated.address import free_port

RATED_SHARE = 1.0 / 3.0  # of the greatest current, for ever: as in examples/drives


COUNTS_PER_TURN, GEAR = 2**20, 25
"""Of simulated CAN drives: encoders so fine that the twin's own are what is felt; their motors' turn so much faster."""


def drives_of(description: RigDescription, port: int, bus: str = "udp") -> str:
    """A `drives.toml` of simulated drives for any machine: what its motors may give, by their data sheets.

    Where they are reached no other machine that is simulated on this computer is: by `port`.
    """
    most = description.per_actuator("torque_max_Nm") / description.nominal_gain
    counts = f"counts_per_turn = {COUNTS_PER_TURN}\nmotor_counts_per_turn = {GEAR * COUNTS_PER_TURN}\n"
    drives = [
        f'[[drives]]\njoint = "{joint}"\nnode = {node}\ncurrent_rated_A = {RATED_SHARE * current:.4g}\n'
        f"current_max_A = {current:.4g}\nbrake_Nms_per_rad = {DAMPING[place]:g}\n"
        f"{counts if bus == 'canopen' else ''}"
        for node, (joint, current, place) in enumerate(
            zip(description.joints, most, description.places, strict=True), start=1
        )
    ]
    bus_table = _BUS[bus].format(port=port, folder=tempfile.gettempdir())
    head = (
        "# Simulated drives, written by exograv for `exograv drive-sim` and for whoever talks to it.\n"
        f'schema_version = 1\nrig = "{description.name}"\nserial = "simulated"\n{bus_table}\n'
    )
    return "\n".join([head, *drives])


_BUS = {
    "udp": "\n[udp]\nport = {port}",
    "canopen": 'period_ms = 2\n\n[canopen]\ninterface = "udp_multicast"\nchannel = "239.74.163.2:{port}"',
    "moteus": "period_ms = 2\n\n[moteus]\npath = '{folder}/exograv_fdcanusb_{port}'",
}


def written(folder: Path, description: RigDescription, bus: str = "udp") -> Path:
    """Such a file of this machine in a folder, with a port of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "drives.toml"
    path.write_text(drives_of(description, free_port(), bus), encoding="utf-8")
    return path
