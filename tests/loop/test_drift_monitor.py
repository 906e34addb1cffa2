"""The drift monitor lets down an arm that its file does not fit, tells about slow lies, and is silent otherwise."""

from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from exograv import motion
from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import RigError
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.drift_finding import ALL_JOINTS, CAUSES, ONE_JOINT, DriftFinding
from exograv.loop.drift_monitor import DriftMonitor
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.recording import RecordingWriter, read_recording
from exograv.rig.twin import Twin
from exograv.runtime.control_loop.exchange import DRIFTED, answer_dtype
from exograv.safety.envelope import Envelope
from exograv.safety.stops import StopReason

SEED, LEVEL = 1001, 1
SPREAD = 0.02
"""Standard deviation of each parameter over its size, as after an identification [-]."""

FOUND_S = 60.0
"""Time in which a much lighter arm in the file has to be found, while the wearer relaxes [s]."""


class Floating:
    """Relaxed arm that floats in a quasi-direct drive machine, by parameters that are known well."""

    def __init__(self, recording: RecordingWriter | None = None, weight: float = 1.0):
        """Begin at rest in the middle of the workspace, with a file that makes the arm `weight` times as heavy."""
        self.laboratory: VirtualLaboratory = draw_laboratory("recupera_like_qdd", None, LEVEL, SEED)
        known: ControllerKnowledge = ideal_knowledge(self.laboratory, 0.0)
        x, self.layout = known.x.copy(), ParameterLayout.of(known.assembly)
        x[self.layout.phi] *= weight
        self.posture = 0.5 * np.sum(self.laboratory.description.workspace, axis=0)
        self.twin: Twin = self.laboratory.twin(SEED, 0.0, self.posture)
        self.controller = ArmController(known.assembly, known.machine, x, self.twin.period_s)
        envelope = Envelope(limits(self.laboratory.description), self.twin.period_s)
        envelope.begin(self.controller.torque_at_rest(self.posture, x))
        self.told = list[str]()
        self.pilot = Pilot(
            self.twin, known.machine.actuators, envelope, recording, lambda text, _: self.told.append(text)
        )
        covariance = np.diag((SPREAD * np.abs(x)) ** 2)
        self.monitor = DriftMonitor(self.controller, covariance, self.twin.period_s)
        self.pilot.drift = self.monitor

    def fly(self, seconds: float) -> None:
        self.pilot.run(self.controller, motion.hold(self.posture, seconds, self.twin.period_s), "floating")


def test_an_arm_in_order_gives_no_finding_and_its_weight_is_confirmed():
    floating = Floating()
    floating.fly(40.0)
    assert floating.monitor.finding is None
    assert floating.monitor.check is not None
    assert not floating.monitor.check.is_contradicted


def test_a_file_of_a_much_heavier_person_is_told():
    floating = Floating(weight=1.6)
    floating.fly(25.0)
    assert floating.monitor.finding is not None
    assert floating.monitor.finding.residual_Nm < -1.0


def test_another_persons_file_lets_the_arm_down_and_the_recording_says_why(tmp_path: Path):
    path = tmp_path / "run.mcap"
    laboratory = draw_laboratory("recupera_like_qdd", None, LEVEL, SEED)
    with RecordingWriter(path, laboratory.description.joints, {}) as recording:
        floating = Floating(recording, 0.5)
        with pytest.raises(RigError, match=r"differs from the model by [+-]\d+\.\d N·m"):
            floating.fly(FOUND_S)
    assert floating.pilot.envelope.stop is StopReason.DRIFTED
    finding = floating.monitor.finding
    assert finding is not None
    assert finding.text(laboratory.description.joints) in floating.told
    ticks = read_recording(path).ticks
    assert np.count_nonzero(ticks["acts"] & DRIFTED) == 1  # a replay trips the guard in this tick


def tilt(floating: Floating) -> None:
    floating.twin.fly(np.array([np.sin(np.deg2rad(10.0)), 0.0, np.cos(np.deg2rad(10.0))]))


def push(floating: Floating) -> None:
    floating.twin.tau_voluntary[0] += 1.5  # as a motor of the shoulder that gives more torque than its current says


@pytest.mark.parametrize(
    ("lie", "cause", "size_Nm"), [pytest.param(tilt, ALL_JOINTS, 1.4, marks=pytest.mark.long), (push, ONE_JOINT, -1.5)]
)
def test_a_lie_that_moves_the_arm_is_told_within_a_minute_with_joint_size_and_cause(
    lie: Callable[[Floating], None], cause: str, size_Nm: float
):
    floating = Floating()
    floating.fly(5.0)
    lie(floating)
    floating.fly(50.0)
    finding = floating.monitor.finding
    assert finding is not None
    assert (finding.joint, finding.cause) == (0, cause)
    assert finding.residual_Nm == pytest.approx(size_Nm, abs=0.3)


@pytest.mark.parametrize(("arm_share", "gravity_level"), [(0.5, 0.0), (1.0, 0.5)])
def test_an_arm_that_its_wearer_carries_in_part_is_not_judged(arm_share: float, gravity_level: float):
    floating = Floating(weight=1.6)
    floating.controller.mode.arm_share, floating.controller.mode.gravity_level = arm_share, gravity_level
    q, tau = floating.posture, np.full(len(floating.posture), 5.0)
    for _ in range(30_000):
        assert floating.monitor.take(q, tau) is None
    assert floating.monitor.check is None


def twice(weight: float) -> tuple[Floating, DriftMonitor, DriftMonitor]:
    """Return a floating arm, and two monitors that take the same ticks: in one piece, and in parts."""
    floating = Floating(weight=weight)
    x = floating.controller.x
    covariance, period_s = np.diag((SPREAD * np.abs(x)) ** 2), floating.twin.period_s
    whole, parts = (DriftMonitor(floating.controller, covariance, period_s, in_parts=split) for split in (False, True))
    floating.controller.mode.arm_share, floating.controller.mode.gravity_level = 1.0, 0.0
    return floating, whole, parts


def test_a_sample_judged_in_parts_gives_the_finding_of_one_piece_within_five_ticks():
    floating, whole, parts = twice(2.0)
    q, tau = floating.posture, floating.controller.torque_at_rest(floating.posture, 0.5 * floating.controller.x)
    at = dict[str, int]()
    for tick in range(60_000):
        for name, monitor in (("whole", whole), ("parts", parts)):
            if name not in at and (found := monitor.take(q, tau)) is not None and found.stops:
                at[name] = tick
        if len(at) == 2:
            break
    assert 0 < at["parts"] - at["whole"] <= 5
    assert parts.finding == whole.finding


def test_no_tick_judges_more_than_one_part_of_a_sample(monkeypatch: pytest.MonkeyPatch):
    floating, _, parts = twice(1.0)
    q, tau = floating.posture, floating.controller.torque_at_rest(floating.posture, floating.controller.x)
    steps, tick = list[tuple[int, str]](), 0

    def note(owner: object, name: str) -> None:
        own = getattr(owner, name)
        monkeypatch.setattr(owner, name, lambda *given: steps.append((tick, name)) or own(*given))

    note(parts._model, "continue_at")
    note(parts._model, "linearise")
    note(parts, "_friction")
    note(parts._test, "take")
    note(parts, "_found")
    while tick < 5000:
        tick += 1
        parts.take(q, tau)
    assert {name for _, name in steps} == {"continue_at", "linearise", "_friction", "take", "_found"}
    ticks = [tick for tick, _ in steps]
    assert len(ticks) == len(set(ticks))


def test_a_restart_between_two_parts_drops_the_sample(monkeypatch: pytest.MonkeyPatch):
    floating, _, parts = twice(1.0)
    q, tau = floating.posture, floating.controller.torque_at_rest(floating.posture, floating.controller.x)
    calls = Mock(spec=parts._test.take)
    for _ in range(5000):
        parts.take(q, tau)
    monkeypatch.setattr(parts._test, "take", calls)
    while parts._judging is None:
        parts.take(q, tau)
    parts.take(q, tau)  # the part before the tests
    parts.restart()
    for _ in range(1000):
        parts.take(q, tau)
    calls.assert_not_called()


def row(level: int, joint: int, cause: int) -> np.void:
    answer = np.zeros(1, answer_dtype(4))[0]
    answer["drift"], answer["drift_joint"], answer["drift_cause"], answer["drift_Nm"] = level, joint, cause, -1.5
    return answer


def test_a_finding_passes_through_an_answer_of_control_and_one_that_cannot_be_is_refused():
    assert DriftFinding.of_answer(row(2, 3, 1)) == DriftFinding(3, -1.5, True, CAUSES[1])
    assert DriftFinding.of_answer(row(1, 0, 0)) == DriftFinding(0, -1.5, False, CAUSES[0])
    for level, joint, cause in ((0, 0, 0), (99, 0, 0), (1, 4, 0), (1, -1, 0), (1, 0, 3), (2, 0, -1)):
        assert DriftFinding.of_answer(row(level, joint, cause)) is None
