"""A stop on purpose passes only with its own cause, in time, slowly, and with all drives off."""

import numpy as np
import pytest

from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.acceptance.dummy import load_dummy
from exograv.procedures.acceptance.stops import STOPS, PurposeStop, Standing, StopFigures, stop_figures, stop_steps
from exograv.recording.encoding import tick_dtype
from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

PERIOD_S = 1e-3
BY_NAME = {stop.name: stop for stop in STOPS}
GOOD = StopFigures(reaction_ms=2.0, hand_m_s=0.6, joint_rad_s=1.0, powered_s=3.0, still_s=8.0, on_at_end=())
BRAKE = np.array([20.0, 20.0, 20.0, 8.0])


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), load_dummy().body)


def flown(stopped_after_s: float, falls_rad_s: float) -> np.ndarray:
    """Return ticks of a raised arm that is stopped after a time, and then sinks at a speed."""
    ticks = np.zeros(4000, tick_dtype(4))
    t = PERIOD_S * np.arange(len(ticks))
    ticks["now"], ticks["monotonic"] = t, 1000.0 + t
    ticks["safe_state"] = np.where(t < stopped_after_s, 0, SafeState.DESCENT + 1)
    ticks["q_measured"] = np.deg2rad([80.0, 10.0, 0.0, 60.0])
    ticks["q_measured"][:, 0] -= falls_rad_s * np.clip(t - stopped_after_s, 0.0, 1.0)
    return ticks


STANDING = Standing(np.array([0.0, 0.5]), np.zeros((2, 4)), ())


def passed(stop: PurposeStop, figures: StopFigures | None, cause: str = "") -> dict[str, bool | None]:
    cause = cause or stop.causes[0].value
    return {step.name: step.passed for step in stop_steps(stop, figures, cause, PERIOD_S, is_by_person=False)}


@pytest.mark.parametrize("stop", STOPS, ids=[stop.name for stop in STOPS])
def test_a_stop_in_time_with_its_own_cause_passes(stop: PurposeStop):
    assert all(passed(stop, GOOD).values())


@pytest.mark.parametrize("stop", STOPS, ids=[stop.name for stop in STOPS])
def test_a_stop_for_another_reason_fails(stop: PurposeStop):
    assert not all(passed(stop, GOOD, StopReason.NOT_FINITE.value).values())


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("operator", {"reaction_ms": 51.0}),
        ("control", {"reaction_ms": 11.0}),
        ("cable", {"reaction_ms": 11.0}),
        ("hardware", {"reaction_ms": np.inf}),
        ("push", {"joint_rad_s": 6.0}),
        ("hardware", {"hand_m_s": 1.1}),
        ("operator", {"still_s": np.inf}),
        ("operator", {"powered_s": 5.0}),
        ("cable", {"on_at_end": ("elbow_flexion",)}),
    ],
)
def test_a_stop_that_is_late_or_fast_or_leaves_a_drive_on_fails(name: str, changed: dict[str, object]):
    figures = StopFigures(**{**vars(GOOD), **changed})  # type: ignore[arg-type]
    found = passed(BY_NAME[name], figures)
    assert sum(not one for one in found.values()) == 1


def test_a_flight_without_a_stop_fails(assembly: Assembly):
    figures = stop_figures("operator", flown(np.inf, 0.0), STANDING, assembly, BRAKE, 1001.0)
    assert figures is None
    found = stop_steps(BY_NAME["operator"], figures, "", PERIOD_S, is_by_person=False)
    assert [(step.passed, step.measured) for step in found] == [(False, "no stop")]


def test_the_reaction_counts_from_the_act_on_the_clock_of_the_computer(assembly: Assembly):
    figures = stop_figures("control", flown(1.5, 0.5), STANDING, assembly, BRAKE, 1001.48)
    assert figures is not None
    assert figures.reaction_ms == pytest.approx(20.0, abs=1.5)
    assert not all(passed(BY_NAME["control"], figures).values())


def test_the_reaction_to_a_silent_drive_counts_from_its_last_word(assembly: Assembly):
    ticks = flown(1.5, 0.5)
    before = ticks["now"] < 1.5
    ticks["q_measured"][before] += 1e-6 * np.arange(np.count_nonzero(before))[:, None]
    ticks["q_measured"][1493:1501, 2] = ticks["q_measured"][1493, 2]
    figures = stop_figures("cable", ticks, STANDING, assembly, BRAKE, None)
    assert figures is not None
    assert figures.reaction_ms == pytest.approx(7.0, abs=0.1)


def test_the_hand_speed_is_that_of_the_sinking_arm(assembly: Assembly):
    slow, fast = (stop_figures("operator", flown(1.5, v), STANDING, assembly, BRAKE, 1001.5) for v in (0.5, 3.0))
    assert slow is not None
    assert fast is not None
    # The hand is 0.2 to 0.63 m from the axis.
    assert 0.1 < slow.hand_m_s < 0.35
    assert fast.hand_m_s == pytest.approx(6.0 * slow.hand_m_s, rel=0.05)


def test_motors_that_still_give_torque_after_the_hardware_stop_are_not_off(assembly: Assembly):
    ticks = flown(1.5, 0.0)
    ticks["faulty"][1500:] = 15
    ticks["tau_measured"] = 8.0
    lasting = stop_figures("hardware", ticks, STANDING, assembly, BRAKE, None)
    ticks["tau_measured"][1530:] = 0.0
    late = stop_figures("hardware", ticks, STANDING, assembly, BRAKE, None)
    assert lasting is not None
    assert late is not None
    assert np.isinf(lasting.reaction_ms)
    assert late.reaction_ms == pytest.approx(30.0, abs=0.1)


def test_a_machine_that_moves_to_the_end_of_the_watch_never_stands_still(assembly: Assembly):
    t = np.arange(0.0, 2.0, 0.01)
    moving = Standing(t, np.outer(t, [0.3, 0.0, 0.0, 0.0]), ())
    figures = stop_figures("operator", flown(1.5, 0.5), moving, assembly, BRAKE, 1001.5)
    assert figures is not None
    assert np.isinf(figures.still_s)


def test_a_hand_that_still_pushes_shortly_after_the_stop_is_not_counted_as_a_fall(assembly: Assembly):
    ticks = flown(1.5, 0.0)
    pushed = (ticks["now"] > 1.5) & (ticks["now"] < 1.6)
    ticks["q_measured"][pushed, 0] += 4.0 * (ticks["now"][pushed] - 1.5)
    ticks["q_measured"][ticks["now"] >= 1.6, 0] += 0.4
    push, other = (stop_figures(name, ticks, STANDING, assembly, BRAKE, 1001.5) for name in ("push", "operator"))
    assert push is not None
    assert other is not None
    assert push.hand_m_s == pytest.approx(0.0, abs=1e-6)
    assert other.hand_m_s > 1.0
