"""Simulated drives are refused with a reason where an option is wrong, and wired as somebody asks."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.session.drive_sim import DriveSimOptions, _wiring, run_drive_sim

EXAMPLES = Path(__file__).parents[2] / "examples" / "drives"
JOINTS = ("shoulder", "elbow")

WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a file of another bus": ({"drives": EXAMPLES / "canopen.toml"}, r"names no \[udp\] bus"),
    "a machine of another name": ({"rig": "agree_like"}, "has the drives of 'recupera_like'"),
    "a joint that is not there": ({"wrong_sign": ("knee",)}, "No joint knee"),
    "no factor": ({"wrong_scale": ("elbow_flexion",)}, "JOINT:FACTOR"),
    "a negative factor": ({"wrong_scale": ("elbow_flexion:-1",)}, "JOINT:FACTOR"),
}


def options(**changes: Any) -> DriveSimOptions:
    plain: dict[str, Any] = {"bus": "udp", "rig": "recupera_like", "side": None, "drives": EXAMPLES / "udp.toml"}
    return DriveSimOptions(**(plain | changes))


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_simulated_is_refused_before_anything_listens(case: str):
    changes, says = WRONG[case]
    with pytest.raises(ConfigError, match=says):
        run_drive_sim(options(**changes), lambda line: None)


def test_wrong_wires_multiply():
    wiring = _wiring(options(wrong_sign=("elbow",), wrong_scale=("elbow:0.5",), wrong_encoder=("shoulder",)), JOINTS)
    np.testing.assert_allclose((wiring["elbow"].current, wiring["elbow"].encoder), (-0.5, 1.0))
    np.testing.assert_allclose((wiring["shoulder"].current, wiring["shoulder"].encoder), (1.0, -1.0))
