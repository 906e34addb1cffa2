"""Weights hang at the machine in full, and are gone in full, at every period of the loop."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import Controller, Guide
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.motion import Trajectory
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.procedures.calibration.empty_run import (
    COOLED_C,
    COOLING_MAX_S,
    WARM_C,
    WARMTH_EVENT,
    WARMTH_EVERY_S,
    EmptyRun,
)
from exograv.procedures.calibration.operator import ComputedOperator
from exograv.recording import RecordingWriter, read_recording
from exograv.rig.drive_status import DriveStatus
from exograv.rig.twin import Disturbances, Twin, draw_machine
from exograv.safety.envelope import Envelope
from exograv.signals import Reference

RIG = load_rig("recupera_like")
STEP_MAX_KG = 0.1
"""Largest step of a weight: a sudden weight would drop the arm."""


class Slower(Twin):
    """Twin whose driver measures every few milliseconds."""

    own_period_s = 1e-3

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        return self.own_period_s


class Warm(Twin):
    """Twin whose drives measure the temperatures of their windings; the last one has no sensor."""

    celsius: tuple[float, ...] = (25.0, 30.0, 35.0, float("nan"))

    def enable(self) -> None:
        """Do nothing: the motors are on."""

    def disable(self) -> None:
        """Do nothing: the motors stay on."""

    def status(self) -> tuple[DriveStatus, ...]:
        """Return the status of each drive."""
        return tuple(DriveStatus(True, temperature_C=celsius) for celsius in self.celsius)


class StillPilot(Pilot):
    """Pilot of a machine that stands still, with a measurement in all ticks but the last."""

    def run(
        self,
        controller: Controller,
        trajectory: Trajectory,
        text: str,
        listener: Callable[[TickSample], None] | None = None,
        guide: Guide | None = None,
    ) -> None:
        """Call the listener for the ticks of the path."""
        state, none = self.rig.read(), np.zeros(len(self.q))
        moment = TickSample(state, self.q, none, none, none, none, Reference(self.q, none, none))
        for _ in range(len(trajectory) - 1):
            assert listener is not None
            listener(moment)


def run_at(description: RigDescription, period_ms: int, hang: Callable[[str, float], None]) -> EmptyRun:
    """Return the run of an empty machine with a loop of this period."""
    tree, seed = read_exoskeleton(description), 0
    twin = Slower(description, draw_machine(description, Disturbances.at_level(0), seed), None, seed)
    twin.own_period_s = 1e-3 * period_ms
    nominal = description.nominal_gain
    envelope = Envelope(limits(description), twin.period_s)
    return EmptyRun(
        description, tree, StillPilot(twin, ActuatorGain(nominal, nominal), envelope), ComputedOperator(hang)
    )


def warmth_events(rig: Twin, path: Path, times: Sequence[float]) -> list[Mapping[str, Any]]:
    """Events of the temperatures in the recording of a run that listens at these times [s]."""
    nominal, none = RIG.nominal_gain, np.zeros(4)
    with RecordingWriter(path, RIG.joints, {"rig": RIG.name}) as recording:
        pilot = Pilot(rig, ActuatorGain(nominal, nominal), Envelope(limits(RIG), rig.period_s), recording)
        run = EmptyRun(RIG, read_exoskeleton(RIG), pilot)
        for t in times:
            state = rig.read()._replace(t=t)
            run.listen(TickSample(state, state.q, none, none, none, none, Reference(state.q, none, none)))
            if isinstance(rig, Warm):
                rig.celsius = tuple(celsius + 1.0 for celsius in rig.celsius)
    return [event for event in read_recording(path).messages("/event") if event["kind"] == WARMTH_EVENT]


def test_temperatures_are_noted_at_the_start_and_then_every_few_seconds(tmp_path: Path):
    warm = Warm(RIG, draw_machine(RIG, Disturbances.at_level(0), 0), None, 0)
    events = warmth_events(warm, tmp_path / "warm.mcap", [0.0, 0.5, WARMTH_EVERY_S, WARMTH_EVERY_S + 0.1])
    assert [event["t"] for event in events] == [0.0, WARMTH_EVERY_S]
    assert [event["text"] for event in events] == ["25.0 30.0 35.0 nan", "27.0 32.0 37.0 nan"]


def test_drives_without_any_sensor_of_temperature_note_nothing(tmp_path: Path):
    machine = draw_machine(RIG, Disturbances.at_level(0), 0)
    blind = Warm(RIG, machine, None, 0)
    blind.celsius = (float("nan"),) * 4
    assert not warmth_events(blind, tmp_path / "blind.mcap", [0.0])
    assert not warmth_events(Twin(RIG, machine, None, 0), tmp_path / "plain.mcap", [0.0])


def cooling(celsius: Sequence[float], falls_C_per_s: float) -> tuple[float, np.ndarray]:
    """Time for which a machine with these windings [°C] waits [s], and their temperatures then [°C]."""

    class Cooling(Warm):
        """Twin whose windings cool down at a constant rate."""

        begun_s = 0.0

        def status(self) -> tuple[DriveStatus, ...]:
            """Return the status of each drive at the present time."""
            fallen = falls_C_per_s * (self.t - self.begun_s)
            return tuple(DriveStatus(True, temperature_C=value - fallen) for value in celsius)

    tree, nominal = read_exoskeleton(RIG), RIG.nominal_gain
    hanging = starting_posture(tree)
    twin = Cooling(RIG, draw_machine(RIG, Disturbances.at_level(0), 0), None, 0, hanging)
    twin.begun_s = twin.t
    run = EmptyRun(RIG, tree, Pilot(twin, ActuatorGain(nominal, nominal), Envelope(limits(RIG), twin.period_s)))
    run.cool(hanging)
    return twin.t - twin.begun_s, np.array([drive.temperature_C for drive in twin.status()])


def test_a_warm_motor_cools_down_before_the_next_pass():
    waited, celsius = cooling([25.0, WARM_C + 1.0, 30.0, float("nan")], falls_C_per_s=2.0)
    assert COOLED_C - 11.0 < celsius[1] <= COOLED_C
    assert waited == pytest.approx((WARM_C + 1.0 - celsius[1]) / 2.0)


@pytest.mark.parametrize("celsius", [[25.0, WARM_C, 30.0, 35.0], [float("nan")] * 4])
def test_motors_that_are_not_warm_or_not_measured_are_not_waited_for(celsius: list[float]):
    assert cooling(celsius, falls_C_per_s=0.0)[0] == 0.0


@pytest.mark.slow
def test_a_motor_that_never_cools_down_is_waited_for_some_minutes_only():
    assert cooling([WARM_C + 1.0] * 4, falls_C_per_s=0.0)[0] == pytest.approx(COOLING_MAX_S, abs=1.0)


def test_the_advice_for_a_hot_motor_names_a_lighter_weight_only_if_a_weight_hangs():
    machine = draw_machine(RIG, Disturbances.at_level(0), 0)
    hot = Warm(RIG, machine, None, 0)
    hot.celsius = (101.0,) * 4
    pilot = Pilot(hot, ActuatorGain(RIG.nominal_gain, RIG.nominal_gain), Envelope(limits(RIG), hot.period_s))
    run = EmptyRun(RIG, read_exoskeleton(RIG), pilot)
    assert "closer to hanging" in run._winding(0)
    assert "lighter" not in run._winding(0)
    run._hung[0, 0] = 1.0
    assert "lighter weights" in run._winding(0)


@pytest.mark.parametrize("period_ms", [1, 2, 4])
def test_a_weight_is_hung_and_taken_off_in_full_and_in_small_steps(period_ms: int):
    description = load_rig("recupera_like")
    hung = [0.0]
    run = run_at(description, period_ms, lambda _mount, mass_kg: hung.append(mass_kg))
    mount = description.calibration.mount
    for weight, stated in ((0, description.calibration.weights_kg[0]), (1, description.calibration.weights_kg[1])):
        run.load(mount, weight)
        assert hung[-1] == stated
    run.load(mount, None)
    assert hung[-1] == 0.0
    assert np.abs(np.diff(hung)).max() < STEP_MAX_KG
