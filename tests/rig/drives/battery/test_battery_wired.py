"""Every driver applies the signs of `drives.toml`, and a motor with other wiring is detected."""

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
"""Number of the elbow joint."""

WIRINGS = {
    "as the file says": (False, (), 1.0),
    "all turned round, and the file says so": (True, (), 1.0),
    "a motor with two leads exchanged": (False, ("--wrong-sign", "elbow_flexion"), -1.0),
    "an encoder that counts the other way": (False, ("--wrong-encoder", "elbow_flexion"), -1.0),
}


@pytest.mark.parametrize("case", WIRINGS)
def test_a_positive_current_moves_a_joint_upwards_only_where_motor_and_encoder_are_as_the_file_says(
    case: str, start: Callable[..., Any], tmp_path: Path
):
    is_turned, wires, direction = WIRINGS[case]
    with start(tmp_path, is_turned, wires) as rig:
        rig.enable()
        before = drive(rig, 0.02).q
        current = np.zeros(4)
        current[ELBOW] = PUSH_A
        moved = drive(rig, PUSH_S, current).q - before
    assert direction * moved[ELBOW] > MOVED_RAD
