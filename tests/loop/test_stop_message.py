"""The text for a stopped machine states reason, joint, value, recording and next step, in one line."""

from pathlib import Path

import numpy as np
import pytest

from exograv.loop.stop_message import stopped_text
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.stops import StopReason

JOINTS = ("shoulder", "elbow")
PATH = Path("out/identify.mcap")


def envelope() -> Envelope:
    return Envelope(Limits(np.array([30.0, 20.0]), np.array([10.0, 4.0])), 0.001)


@pytest.mark.parametrize("reason", StopReason)
def test_every_stop_says_what_is_kept_and_what_to_do_in_one_line(reason: StopReason):
    stopped = envelope()
    stopped.trip(reason)
    text = stopped_text(stopped, JOINTS, PATH)
    assert reason.value in text
    assert str(PATH) in text
    assert "\n" not in text
    assert not text.endswith(f"{PATH}.")


def test_a_joint_that_was_too_fast_is_named_with_the_limit():
    stopped = envelope()
    v = np.array([0.1, -5.25])
    stopped.limit(np.zeros(2), np.zeros(2), v)
    text = stopped_text(stopped, JOINTS, None)
    assert "At: elbow; allowed here: 5.0 rad/s" in text
    assert "shoulder" not in text


def test_a_joint_whose_encoder_is_distrusted_is_named():
    stopped = envelope()
    stopped.trip(StopReason.ENCODER_JUMPED, isolate=(1,))
    assert "At: elbow." in stopped_text(stopped, JOINTS, None)
