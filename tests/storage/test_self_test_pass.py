"""A real machine carries an arm only if its self-test has passed here, today, without a fault since."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace, TracebackType

import numpy as np
import pytest

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError, RigError
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.description import load_rig
from exograv.motion import hold
from exograv.procedures.calibration.breakaway_test import BreakawayPush
from exograv.procedures.self_test.self_test_command import keep
from exograv.rig import may_be_worn
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.stops import StopReason
from exograv.signals import Command, JointState, TorqueSource
from exograv.storage.self_test_pass import NOT_NEEDED, MachineKey, unlock, withdraw_pass, write_pass
from exograv.storage.self_test_step import Step

NOON = datetime(2026, 11, 22, 12, 0, tzinfo=UTC)
SEAL = "a" * 64


class Metal:
    """Machine of one joint that stands still and does not state that it is virtual."""

    joints: tuple[str, ...] = ("elbow",)
    period_s = 0.001

    def __init__(self):
        self.t, self._tau = 0.0, np.zeros(1)

    def read(self) -> JointState:
        return JointState(
            self.t, round(self.t / 0.001), np.zeros(1), self._tau, np.full(1, np.nan), TorqueSource.CURRENT
        )

    def write(self, command: Command) -> None:
        self.t, self._tau = self.t + 0.001, command.tau

    def __enter__(self) -> "Metal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class Computed(Metal):
    is_virtual = True


@pytest.fixture
def key(tmp_path: Path) -> MachineKey:
    return MachineKey(tmp_path / "self_test.toml", load_rig("recupera_like"), "serial 7", SEAL, "laboratory")


def pilot(key: MachineKey | None) -> Pilot:
    envelope = Envelope(Limits(np.array([10.0]), np.array([4.0]), descent_s=0.1), 0.001)
    return Pilot(Metal(), ActuatorGain(np.ones(1), np.zeros(1)), envelope, key=key)


def test_a_machine_that_does_not_state_that_it_is_virtual_may_be_worn():
    assert may_be_worn(Metal())
    assert not may_be_worn(Computed())


def test_a_real_machine_whose_guard_is_not_compiled_stays_locked(key: MachineKey, monkeypatch: pytest.MonkeyPatch):
    write_pass(key, NOON)
    monkeypatch.setattr("exograv.safety.native.library.LIBRARY", None)
    with pytest.raises(RigError, match="The machine is locked: the guard is not compiled"):
        unlock(Metal(), key, NOON)
    assert unlock(Computed(), None) == NOT_NEEDED


def test_a_twin_needs_no_self_test():
    assert unlock(Computed(), None) == NOT_NEEDED


def test_without_a_self_test_a_real_machine_is_locked(key: MachineKey):
    for missing in (None, key):
        with pytest.raises(RigError, match=r"locked: no self-test has passed here\. Run `exograv rig self-test`"):
            unlock(Metal(), missing)


def test_a_self_test_of_today_unlocks_until_midnight(key: MachineKey):
    write_pass(key, NOON)
    assert unlock(Metal(), key, NOON).startswith("passed at 2026-11-22T12:00:00")
    assert unlock(Metal(), key, NOON + timedelta(hours=11, minutes=59))
    with pytest.raises(RigError, match="passed on 2026-11-22, and today is 2026-11-23"):
        unlock(Metal(), key, NOON + timedelta(hours=12))


def test_the_day_is_that_of_local_time(key: MachineKey):
    write_pass(key, NOON)
    tokyo = NOON.astimezone(datetime.fromisoformat("2026-11-22T00:00:00+09:00").tzinfo)
    with pytest.raises(RigError, match="today is 2026-11-23"):
        unlock(Metal(), key, tokyo + timedelta(hours=4))


OTHERS: dict[str, tuple[Callable[[MachineKey], MachineKey], type[Exception], str]] = {
    "computer": (lambda key: replace(key, host="office"), RigError, "passed on the computer 'laboratory'"),
    "calibration": (lambda key: replace(key, calibration_sha256="b" * 64), RigError, "calibrated again after"),
    "serial number": (lambda key: replace(key, machine="serial 8"), ConfigError, "of another machine"),
    "rig": (lambda key: replace(key, description=load_rig("recupera_like_qdd")), ConfigError, "of another machine"),
    "side": (lambda key: replace(key, description=load_rig("recupera_like", "left")), ConfigError, "another machine"),
}


@pytest.mark.parametrize("what", OTHERS)
def test_another_machine_or_calibration_stays_locked(key: MachineKey, what: str):
    change, kind, sentence = OTHERS[what]
    write_pass(key, NOON)
    with pytest.raises(kind, match=sentence):
        unlock(Metal(), change(key), NOON)


def test_a_self_test_of_tomorrow_s_clock_does_not_unlock(key: MachineKey):
    write_pass(key, NOON)
    with pytest.raises(RigError, match="from the future"):
        unlock(Metal(), key, NOON - timedelta(minutes=1))


def test_an_edited_file_does_not_unlock(key: MachineKey):
    write_pass(key, NOON)
    text = key.file.read_text(encoding="utf-8")
    key.file.write_text(text.replace("2026-11-22", "2026-11-23"), encoding="utf-8")
    with pytest.raises(ConfigError, match="damaged or edited"):
        unlock(Metal(), key, NOON + timedelta(days=1))


def test_a_fault_locks_until_the_next_self_test(key: MachineKey):
    write_pass(key, NOON)
    withdraw_pass(key.file, "A drive reports a fault.")
    with pytest.raises(RigError, match=r"a fault has stopped it \(A drive reports a fault\.\)"):
        unlock(Metal(), key, NOON)
    write_pass(key, NOON)
    assert unlock(Metal(), key, NOON)


def test_a_failed_self_test_withdraws_an_earlier_pass(key: MachineKey):
    good, bad, slow = Step("clock", True), Step("Stop is heard", False), Step("ticks", False, locks_only=True)
    assert keep(key, [good], False, NOON).startswith("passed")
    assert unlock(Metal(), key, NOON)
    for failed in (bad, slow, Step("not tried", None)):
        keep(key, [good], False, NOON)
        assert keep(key, [good, failed], False, NOON) == f"locked: {failed.name}"
        with pytest.raises(RigError, match="locked"):
            unlock(Metal(), key, NOON)


def test_no_pilot_carries_an_arm_on_a_locked_machine(key: MachineKey):
    arm = ArmController.__new__(ArmController)  # refused before it moves
    arm._tick = SimpleNamespace(tau_feedforward=np.zeros(1), closure_slope=0.0, clearance=1.0)  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(RigError, match="locked"):
        pilot(None).run(arm, hold(np.zeros(1), 0.01, 0.001), "")


def test_an_empty_machine_needs_no_key():
    pilot(None).run(BreakawayPush(np.zeros(1)), hold(np.zeros(1), 0.01, 0.001), "")


def test_a_stop_in_flight_locks_the_machine(key: MachineKey):
    write_pass(key, datetime.now().astimezone())
    flying = pilot(key)
    assert unlock(flying.rig, key)

    def trip(_moment: TickSample) -> None:
        flying.envelope.trip(StopReason.ENCODERS_PART)

    with pytest.raises(RigError, match="was stopped"):
        flying.run(BreakawayPush(np.zeros(1)), hold(np.zeros(1), 0.01, 0.001), "", trip)
    with pytest.raises(RigError, match="a fault has stopped it"):
        unlock(flying.rig, key)


def test_a_locked_machine_is_refused_with_the_whole_command_of_its_self_test(key: MachineKey):
    test = "exograv rig self-test --drives drives.toml --out bench"
    with pytest.raises(RigError, match=rf"`{test}`"):
        unlock(Metal(), replace(key, test=test), NOON)
