"""Person at the keyboard: asked once, while the machine keeps holding."""

import os

from exograv.procedures.calibration.operator import KeyboardOperator


def test_the_operator_is_asked_once_per_weight_and_is_ready_when_enter_is_pressed():
    asked: list[str] = []
    end, keys = os.pipe()
    with os.fdopen(end) as answers:
        operator = KeyboardOperator(asked.append, answers)
        assert not operator.is_ready("mount", 1.5)
        assert not operator.is_ready("mount", 1.5)
        assert len(asked) == 1
        assert "1.5 kg" in asked[0]
        os.write(keys, b"\n")
        assert operator.is_ready("mount", 1.5)
        assert not operator.is_ready("mount", 0.0)
        assert "take the weight off 'mount'" in asked[1]
    os.close(keys)
