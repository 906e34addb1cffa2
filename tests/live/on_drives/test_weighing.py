"""A weighing over drives asks a person for each weight, and has the form and the machine of its command."""

from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.live.on_drives.support_level import live_options
from exograv.live.on_drives.weighing import WeightAtPerson
from exograv.loop.moved_machine import MovedMachine
from exograv.procedures.calibration.operator import Operator
from exograv.procedures.weighing.options import WeighOptions
from exograv.procedures.weighing.placed_weight import STEPS, PlacedWeight


def test_the_person_is_asked_once_for_each_weight_and_enter_is_the_answer():
    said, typed = list[str](), [False, False, True, False, True]
    operator = WeightAtPerson(said.append, lambda: typed.pop(0))
    assert [operator.is_ready("hand", 1.0) for _ in range(3)] == [False, False, True]
    assert [operator.is_ready("hand", 0.0) for _ in range(2)] == [False, True]
    assert len(said) == 2
    assert "put the weight in the hand" in said[0]
    assert "take away the weight in the hand" in said[1]


def placed(machine: MovedMachine, lowered: list[float]) -> PlacedWeight:
    operator = Mock(spec=Operator, lowers_s=4.0)
    operator.is_ready.side_effect = [False, True, True]
    operator.lower.side_effect = lambda _place, kg: lowered.append(kg)
    return PlacedWeight(machine, operator, "hand", 1.5)


def test_a_weight_comes_and_goes_in_steps_while_the_machine_holds_the_arm():
    machine, lowered = Mock(spec=MovedMachine), list[float]()
    weight = placed(machine, lowered)
    weight.put(False)
    assert lowered == []
    weight.put(True)
    assert len(lowered) == STEPS
    assert lowered[-1] == 1.5
    assert np.diff(lowered).min() > 0.0
    assert machine.hold.call_count == STEPS + 1
    weight.put(False)
    assert lowered[-1] == 0.0


def test_the_live_run_has_the_machine_of_the_command():
    options = WeighOptions(drives=Path("drives.toml"))
    live = live_options(options, options.identify_s, 100.0)
    assert (live.rig, live.drives, live.identify_s, live.seconds) == (options.rig, options.drives, 60.0, 100.0)


def test_a_motion_that_is_too_short_is_refused():
    with pytest.raises(ConfigError, match="--identify"):
        live_options(WeighOptions(simulate=True), 5.0, 100.0)
