"""A tick in native code gives the same rows, commands and state of the guard as a tick in Python, to the last bit."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from exograv import motion
from exograv.control.exo_tick import ExoTick
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import RigError
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.native import library, record
from exograv.loop.native_ticks import NativeTicks
from exograv.loop.person_limits import person_limits
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.options import WorldName
from exograv.procedures.calibration.breakaway_test import BreakawayPush, starting_posture
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.recording import RecordingWriter, read_recording
from exograv.rig.twin import Twin
from exograv.rig.twin.world import poles
from exograv.rig.twin.world.scene import TIMESTEP
from exograv.safety.envelope import Envelope
from exograv.safety.person import GuardedPerson

SEED = 1000
FREE = {"tick_us", "cdr_header"}
"""Fields that differ between two runs of the same seed."""

Fly = Callable[[Pilot, Twin], list[np.ndarray]]


@dataclass(frozen=True)
class Flown:
    """Result of a run: recorded ticks and messages, values that listeners saw, record of the guard, native ticks."""

    ticks: np.ndarray
    messages: list[object]
    seen: np.ndarray
    guard: np.ndarray
    q: np.ndarray
    native_ticks: int


@pytest.fixture(scope="module")
def laboratory() -> VirtualLaboratory:
    return draw_laboratory("recupera_like", None, 2, SEED)


@pytest.fixture(autouse=True)
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    if library.LIBRARY is None:
        pytest.skip("The tick is not compiled on this computer.")


def fly(
    twin: Twin, actuators: ActuatorGain, path: Path, act: Fly, monkeypatch: pytest.MonkeyPatch, native: bool
) -> Flown:
    counted, run = 0, NativeTicks.run

    def counting(*given: object) -> object:
        nonlocal counted
        counted += 1
        return run(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(NativeTicks, "run", counting)
    if not native:
        monkeypatch.setattr(NativeTicks, "of", lambda *_: None)
    with RecordingWriter(path, twin.joints, {"rig": "recupera_like"}, packed=True) as recording:
        pilot = Pilot(twin, actuators, Envelope(limits(twin._description), twin.period_s), recording)
        seen = act(pilot, twin)
    monkeypatch.undo()
    found = read_recording(path)
    return Flown(
        found.ticks,
        [found.messages("/event"), found.messages("/control")],
        np.array(seen),
        pilot.envelope.record.view.copy(),
        pilot.q,
        counted,
    )


def compare(
    make: Callable[[], Twin], actuators: ActuatorGain, act: Fly, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> Flown:
    """Fly twice, and return the native flight after the comparison."""
    in_c = fly(make(), actuators, folder / "c.mcap", act, monkeypatch, native=True)
    in_python = fly(make(), actuators, folder / "python.mcap", act, monkeypatch, native=False)
    assert in_python.native_ticks == 0
    assert len(in_c.ticks) == len(in_python.ticks)
    for name in in_c.ticks.dtype.names or ():
        if name not in FREE:
            np.testing.assert_array_equal(in_c.ticks[name], in_python.ticks[name], err_msg=name)
    assert in_c.messages == in_python.messages
    for name in ("seen", "guard", "q"):
        np.testing.assert_array_equal(getattr(in_c, name), getattr(in_python, name), err_msg=name)
    return in_c


def values(moment: TickSample) -> np.ndarray:
    state = moment.state
    q_motor = np.zeros(0) if state.q_motor is None else state.q_motor
    return np.concatenate([[state.t, state.sequence], state.q, state.current, q_motor, *moment[1:6], *moment.reference])


def nominal(laboratory: VirtualLaboratory) -> CalibratedMachine:
    return nominal_machine(laboratory.description, laboratory.assembly().exo.phi)


def test_an_empty_machine_is_pushed_and_swept_with_a_weight_alike(
    laboratory: VirtualLaboratory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    description, lengths = laboratory.description, laboratory.wearer.lengths_given
    tree = adjusted(read_exoskeleton(description), description, lengths)
    start, gain = starting_posture(tree), description.nominal_gain

    def act(pilot: Pilot, twin: Twin) -> list[np.ndarray]:
        seen: list[np.ndarray] = []
        push, tick = BreakawayPush(np.zeros(4)), ExoTick(description, tree)

        def harder(moment: TickSample) -> None:
            seen.append(values(moment))
            push.tau[1] += 0.02

        def load(moment: TickSample) -> None:
            seen.append(values(moment))
            if len(seen) % 50 == 0:
                tick.hang(description.calibration.mount, 0.002 * len(seen))
                twin.hang(description.calibration.mount, 0.002 * len(seen))

        pilot.begin("calibrate")
        pilot.run(push, motion.hold(start, 0.1, twin.period_s), "", harder)
        pilot.run(tick, motion.go_to(start, start + 0.1, 0.5, twin.period_s), "", load)
        return seen

    def make() -> Twin:
        return Twin(description, laboratory.machine, None, SEED, start, lengths=lengths)

    flown = compare(make, ActuatorGain(gain, 0.1 * gain), act, tmp_path, monkeypatch)
    assert flown.native_ticks > 0.9 * len(flown.ticks)


@pytest.mark.parametrize("world", ["home", "all", "unseen"])
def test_a_worn_machine_is_driven_published_to_loaded_and_floated_alike(
    world: WorldName, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    laboratory = draw_laboratory("recupera_like", None, 2, SEED, world=world)
    assembly, machine = laboratory.assembly(), nominal(laboratory)
    x = table_guess(assembly, machine)
    person = person_limits(assembly, machine, x)

    def act(pilot: Pilot, twin: Twin) -> list[np.ndarray]:
        arm, seen, random = ArmController(assembly, machine, x, twin.period_s), [], np.random.default_rng(SEED)
        arm.mode.drive = 1.0
        pilot.envelope.person = GuardedPerson(person)
        pilot.envelope.person.drive(True)

        def learn(moment: TickSample) -> None:
            seen.append(values(moment))
            if len(seen) % 100 == 0:
                arm.publish(x * (1.0 + 0.02 * random.uniform(-1.0, 1.0)), moment.q)
            arm.mode.drive = max(0.0, 1.0 - max(len(seen) - 400, 0) / 200)
            if len(seen) > 600 and pilot.envelope.person is not None:
                arm.mode.gravity_level = pilot.envelope.person.gravity_level = min((len(seen) - 600) / 900, 0.3)

        start = pilot.q.copy()
        pilot.begin("identify")
        path = motion.go_to(start, start + 0.05, 0.3, twin.period_s)
        part = np.hstack([path.q, path.q])[:, : len(start)]  # rows that do not follow each other in memory
        pilot.run(arm, replace(path, q=part), "", learn)
        arm.carry("hand", 0.8, pilot.q)
        twin.hang("hand", 0.8)
        pilot.run(arm, motion.hold(pilot.q, 0.5, twin.period_s), "", learn)
        arm.put_in_force(x)
        pilot.begin("float")
        pilot.run(arm, motion.hold(pilot.q, 0.3, twin.period_s), "", learn)
        return seen

    def make() -> Twin:
        return Twin(laboratory.description, laboratory.machine, laboratory.wearer, SEED)

    flown = compare(make, machine.actuators, act, tmp_path, monkeypatch)
    assert flown.native_ticks > 0.9 * len(flown.ticks)
    assert np.ptp(flown.ticks["gravity_level"]) > 0.1


def test_a_machine_without_encoders_on_its_motors_floats_alike_and_records_none(
    laboratory: VirtualLaboratory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    plain = replace(laboratory.machine, sensors=replace(laboratory.machine.sensors, has_motor_encoders=False))
    assembly, machine = laboratory.assembly(), nominal(laboratory)

    def act(pilot: Pilot, twin: Twin) -> list[np.ndarray]:
        seen: list[np.ndarray] = []
        tick = ExoTick(laboratory.description, assembly.exo)
        pilot.run(tick, motion.hold(pilot.q.copy(), 0.2, twin.period_s), "", lambda moment: seen.append(values(moment)))
        return seen

    def make() -> Twin:
        return Twin(laboratory.description, plain, laboratory.wearer, SEED)

    flown = compare(make, machine.actuators, act, tmp_path, monkeypatch)
    assert flown.native_ticks > 0.9 * len(flown.ticks)
    assert np.isnan(flown.ticks["q_motor"]).all()


def test_the_damping_at_the_pole_of_the_shoulder_s_angles_changes_hands_alike(
    laboratory: VirtualLaboratory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def act(pilot: Pilot, twin: Twin) -> list[np.ndarray]:
        seen: list[np.ndarray] = []

        def learn(moment: TickSample) -> None:
            seen.append(np.append(values(moment), [pole._is_near[0] for pole in twin._poles]))

        start = pilot.q.copy()
        tick = ExoTick(laboratory.description, assembly.exo)
        pilot.run(tick, motion.go_to(start, start + 0.2, 0.5, twin.period_s), "", learn)
        return seen

    def make() -> Twin:
        return Twin(laboratory.description, laboratory.machine, laboratory.wearer, SEED)

    assembly, gain = laboratory.assembly(), laboratory.machine.drives.gain
    # The inertia at which the damping changes hands is the one of the posture in which this arm begins.
    pole = make()._poles[0]
    flexion, rotation, both = pole._data.M[pole._places].tolist()
    inertia = (flexion * rotation - both * both) / (flexion + rotation)
    with pytest.MonkeyPatch.context() as poles_everywhere:
        poles_everywhere.setattr(poles, "FAR_COSINE", 2.0)
        poles_everywhere.setattr(poles, "STABLE_SHARE", float(pole._damping.max()) * TIMESTEP / inertia)
        flown = compare(make, ActuatorGain(gain, 0.01 * gain), act, tmp_path, monkeypatch)
    assert flown.native_ticks > 0.9 * len(flown.ticks)
    assert set(flown.seen[:, -1]) == {0.0, 1.0}


@pytest.mark.parametrize("fault", ["motor", "noise"])
def test_a_fault_in_a_native_tick_ends_in_the_same_descent(
    fault: str, laboratory: VirtualLaboratory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    description, lengths = laboratory.description, laboratory.wearer.lengths_given
    tree = adjusted(read_exoskeleton(description), description, lengths)
    start, gain = starting_posture(tree), laboratory.machine.drives.gain

    def act(pilot: Pilot, twin: Twin) -> list[np.ndarray]:
        seen: list[np.ndarray] = []

        def strike(moment: TickSample) -> None:
            seen.append(values(moment))
            if len(seen) == 60 and fault == "motor":
                twin.turn_motor(1, -40.0)
            if len(seen) == 60 and fault == "noise":
                twin._sensors.noise[:] = np.nan

        tick = ExoTick(description, tree)
        with pytest.raises(RigError):
            pilot.run(tick, motion.go_to(start, start + 0.3, 0.5, twin.period_s), "", strike)
        return seen

    def make() -> Twin:
        return Twin(description, laboratory.machine, None, SEED, start, lengths=lengths)

    flown = compare(make, ActuatorGain(gain, 0.01 * gain), act, tmp_path, monkeypatch)
    assert flown.native_ticks > 60
    assert (flown.ticks["safe_state"] > 0).any()


def test_native_ticks_are_not_used_for_a_machine_with_a_read_or_write_of_its_own(laboratory: VirtualLaboratory):
    class Watched(Twin):
        pass

    gain = laboratory.machine.drives.gain
    for kind, is_native in ((Twin, True), (Watched, False)):
        twin = kind(laboratory.description, laboratory.machine, None, SEED)
        pilot = Pilot(twin, ActuatorGain(gain, gain), Envelope(limits(laboratory.description), twin.period_s))
        assert (pilot._native is not None) == is_native


def test_the_header_is_the_one_of_the_classes():
    assert record.HEADER.read_text(encoding="utf-8") == record.text()


def test_a_library_of_another_layout_is_not_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "lock_step.native"
    if not library.build_lock_step(path):
        pytest.skip("no C compiler")
    assert library.load(path) is not None
    monkeypatch.setattr(record, "CONSTANTS", {**record.CONSTANTS, "GUARD_STOP": 7})
    assert library.load(path) is None
    assert library.load(tmp_path / "missing") is None
