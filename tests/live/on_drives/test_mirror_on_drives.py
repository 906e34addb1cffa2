"""Mirror therapy over simulated drives that wait: one arm follows the other, and the run replays exactly."""

from pathlib import Path

import numpy as np
import pytest
from tests.live.on_drives.ready_machine import ReadyMachine

from exograv.errors import ConfigError
from exograv.live.on_drives.mirror import run_mirror_on_drives
from exograv.live.options import ReturningPerson
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.rehabilitation.guided.grip import GripOutcome
from exograv.procedures.rehabilitation.guided.mirror_map import MirrorMap
from exograv.procedures.rehabilitation.guided.options import MirrorOptions
from exograv.procedures.rehabilitation.guided.pull import PullStrength
from exograv.recording import read_recording

RIG = load_rig("recupera_like_dual")
MIRROR_RMS_DEG, LATE_S = 5.0, 0.3
"""Largest RMS error of a joint [°], as in lock-step, and largest delay [s]: twice that of the guide."""


def test_a_machine_for_one_arm_is_refused_before_anything_starts(tmp_path: Path):
    options = MirrorOptions(rig="recupera_like", simulate=True)
    with pytest.raises(ConfigError, match="does not have two arms"):
        run_mirror_on_drives(options, ReturningPerson(), tmp_path, lambda *_: None, lambda _: None)


@pytest.mark.slow
def test_one_arm_leads_the_other_over_drives_and_the_run_replays_exactly(tmp_path: Path):
    machine = ReadyMachine.made(tmp_path, RIG.name)
    # Shorter than the leading arm's movement: encoders without noise would stand still at its end, as broken ones do.
    found = machine.flown("run", "mirror", RIG.name, "--identify", "10", "--seconds", "8")
    which = MirrorMap.of(RIG, read_exoskeleton(RIG), "right")
    print({name: found[name] for name in ("tracking_rms_deg", "late_s", "late_rms_deg", "pull_max_Nm")})
    assert (found["outcome"], found["is_simulated"]) == (GripOutcome.ENDED.value, True)
    assert max(found["tracking_rms_deg"]) < MIRROR_RMS_DEG
    assert 0.0 < found["late_s"] < LATE_S
    pull = np.array(found["pull_max_Nm"])
    assert not pull[which.lead].any()
    assert (pull <= PullStrength.of(RIG).bound).all()
    assert found["live"]["outcome"].startswith("Stop was pressed.")
    path = tmp_path / found["recording"]
    recording = read_recording(path)
    events = list(recording.messages("/event"))
    assert [one for one in events if one["kind"] == "warning"] == []
    begun, ended = (one["t"] for one in events if one.get("text") in ("Procedure: mirror.", "Stop was pressed."))
    mirrored = (recording.ticks["t"] > begun) & (recording.ticks["t"] < ended)
    assert np.ptp(recording.ticks["q_measured"][mirrored], axis=0)[which.follow].max() > np.deg2rad(10.0)
    assert "to the last bit" in machine.replayed(path)
