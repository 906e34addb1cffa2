"""Machine on UDP that nobody wears, and control that asks for nothing: what `live_loop.py` flies.

A process of its own imports this module; it cannot import the script that started it.
"""

from pathlib import Path

import numpy as np

from exograv.live.guard_job import GuardedRig
from exograv.model.description import load_rig
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.udp.host import UdpRig
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.safety.limits import Limits


class UnwornRig(UdpRig):
    """Machine on UDP that nobody wears: a stop of the guard does not end the slice."""

    is_virtual = True


def build(path: Path) -> GuardedRig:
    """Return the machine and its guard, in the process that owns them."""
    drives = load_drives(path, load_rig("recupera_like"))
    n = len(drives.joints)
    envelope = Envelope(Limits(np.full(n, 30.0), np.full(n, 10.0)), drives.period_s)
    guard = Guard.of_machine(envelope, drives.period_s, [4.0] * n, is_known=False)
    return GuardedRig(UnwornRig(drives), guard, np.full(n, 4.0))


class Nothing:
    """Control that asks for no torque."""

    mode_names = ("floating",)

    def answer(self, state: np.void, row: np.ndarray) -> None:
        """Answer one state."""
        row["mode"], row["slope"], row["tau"] = 0, 0.0, 0.0
        row["v"], row["tau_feedforward"], row["q_reference"] = 0.0, 0.0, np.nan
