"""Designed motion: a valid block for a rig file, better than the one before it, within its limits."""

import tomllib
from itertools import count

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.identification.excitation import MotionLimits, design, harmonic
from exograv.identification.excitation.basis import Coefficients, excitation_block, excitation_text
from exograv.identification.excitation.problem import MotionProblem
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.rig_settings import Excitation
from exograv.model.support import assemble
from exograv.procedures.machine_tools.design_motion import design_motion, periodic
from exograv.procedures.machine_tools.options import DesignOptions

ROUNDING = 0.01
"""Share of a limit by which the rounding to 0.1° in the file may exceed it."""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"period_s": 1.0}, "--period-s is 1.0; allowed: 5 to 120 s"),
        ({"period_s": 10.0, "harmonics": 9}, "--harmonics is 9; allowed with a period of 10 s: 1 to 6"),
        ({"seconds": 0.0}, "--seconds is 0.0; allowed: 1 to"),
    ],
)
def test_what_cannot_be_designed_is_refused_with_what_is_allowed(options: dict, message: str):
    with pytest.raises(ConfigError, match=message):
        DesignOptions(**options)


def test_the_block_is_the_motion_as_a_rig_file_has_it():
    basis = harmonic(20.0, 3)
    coefficients = 0.2 * np.random.default_rng(0).standard_normal((7, 4))
    read = tomllib.loads(excitation_text(excitation_block(basis, coefficients)))
    path = periodic(Excitation(**read["excitation"]), 20.0, 0.1)
    np.testing.assert_allclose(path.q, basis.trajectory(coefficients, 20.0, 0.1).q, atol=np.deg2rad(0.05 * 7))


def test_a_machine_without_motors_has_no_motion_to_design():
    with pytest.raises(ConfigError, match="no motor"):
        design_motion(DesignOptions("recupera_like_passive"), lambda _text, _share: None)


def interrupt_at(call: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the optimiser return its start, and let Ctrl-C come in this call."""
    calls = count()

    def search(_problem: MotionProblem, start: Coefficients, _iterations: int, _seconds: float) -> Coefficients:
        if next(calls) == call:
            raise KeyboardInterrupt
        return start

    monkeypatch.setattr(design, "solve", search)


def test_ctrl_c_keeps_the_best_motion_of_the_starts_before_it(monkeypatch: pytest.MonkeyPatch):
    interrupt_at(1, monkeypatch)
    figures = design_motion(DesignOptions(starts=2), lambda _text, _share: None).figures
    assert figures.is_interrupted
    assert figures.starts == 1
    # The only start was the machine's present motion, scaled into the limits.
    assert figures.excitation.period_s == load_rig("recupera_like").excitation.period_s


def test_ctrl_c_during_the_first_start_ends_the_command(monkeypatch: pytest.MonkeyPatch):
    interrupt_at(0, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        design_motion(DesignOptions(starts=2), lambda _text, _share: None)


@pytest.mark.slow
def test_a_designed_motion_tells_more_than_others_and_keeps_the_limits():
    told: list[float] = []
    options = DesignOptions(starts=1, iterations=15, seconds=600.0, period_s=20.0, harmonics=5)
    designed = design_motion(options, lambda _text, share: told.append(share))
    predicted = designed.figures.predicted_left_over_Nm
    targets = np.array(designed.figures.targets_Nm)
    worst = {name: (np.array(found["60"]) / targets).max() for name, found in predicted.items()}
    assert worst["designed"] < worst["fixed"]
    description = load_rig("recupera_like")
    limits = MotionLimits.of(assemble(description, Body(1.70, 70.0, "female")))
    path = designed.path
    assert not limits.broken_by_motion(path.q, path.v, path.a, slack=ROUNDING).any()
    assert told[0] == 0.0
    assert told[-1] == 1.0
