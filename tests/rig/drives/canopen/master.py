"""Process that a test kills: enables a machine on a CAN bus and holds it at zero torque.

python master.py DRIVES.toml
"""

import sys
import time
from pathlib import Path

import numpy as np

from exograv.errors import RigError
from exograv.model.description import load_rig
from exograv.rig.drives.canopen import CanopenRig
from exograv.rig.drives.settings import load_drives
from exograv.signals import Command

PATIENCE_S = 0.2
"""Time-out for an answer [s]: a computer that runs all tests at once may be that slow."""


def main() -> None:
    """Print `on` when the drives are on."""
    drives = load_drives(Path(sys.argv[1]), load_rig("recupera_like"))
    none = np.zeros(len(drives.each))
    with CanopenRig(drives, PATIENCE_S) as rig:
        is_told = False
        while True:
            state = rig.read()
            if state.faulty or not is_told:
                try:
                    rig.enable()
                except RigError:
                    continue
            if not is_told:
                print("on", flush=True)
                is_told = True
            rig.write(Command(rig.t, state.sequence, rig.t + 0.01, none, none))
            time.sleep(rig.period_s)


if __name__ == "__main__":
    main()
