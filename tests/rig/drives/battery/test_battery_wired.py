"""Signs of `drives.toml` are turned back by every driver, and a motor that is wired otherwise than it says is seen."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .driving import drive

LOCK_STEP = True
PUSH_A, PUSH_S = 2.0, 0.15
MOVED_RAD = 0.01
ELBOW = 3
"""The elbow."""

WIRINGS = {
    "as the file says": ((), (), 1.0),
    "all turned round, and the file says so": (("sign",), (), 1.0),
    "a motor with two leads exchanged": ((), ("--wrong-sign", "elbow_flexion"), -1.0),
    "an encoder that counts the other way": ((), ("--wrong-encoder", "elbow_flexion"), -1.0),
}
SIGNED = 'joint = "elbow_flexion"\nnode = 4\n'


@pytest.mark.parametrize("case", WIRINGS)
def test_a_positive_current_moves_a_joint_upwards_only_where_motor_and_encoder_are_as_the_file_says(
    case: str, start: Callable[..., Any], tmp_path: Path
):
    signs, wires, direction = WIRINGS[case]
    changes = ((SIGNED, SIGNED + "sign = -1\n"),) if signs else ()
    with start(tmp_path, changes, wires) as rig:
        rig.enable()
        before = drive(rig, 0.02).q
        current = np.zeros(4)
        current[ELBOW] = PUSH_A
        moved = drive(rig, PUSH_S, current).q - before
    assert direction * moved[ELBOW] > MOVED_RAD
