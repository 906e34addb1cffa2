"""Ticks of a pilot in native code, where everything that takes part has native code."""

import ctypes

import numpy as np

from exograv.control.native_law import NativeLaw
from exograv.motion import Trajectory
from exograv.recording import RecordingWriter
from exograv.recording.tick_row import JOINT_FIELDS, SCALARS
from exograv.rig import Rig
from exograv.rig.native_period import NativelySimulated, NativePeriod
from exograv.safety.guard import COMMAND_LIFE_S, Guard
from exograv.signals import Command, Joints, JointState, Reference, TorqueSource

from .native import record
from .native.library import LIBRARY
from .output_feedback import Controller, OutputFeedback
from .replay_log import NO_MODE

_BY_CURRENT = TorqueSource.CURRENT


class NativeTicks:
    """Ticks of one pilot. `Pilot._tick` is their definition; these give the same rows and commands."""

    def __init__(self, rig: NativelySimulated, period: NativePeriod, library: ctypes.PyDLL, guard: Guard, gain: Joints):
        """Bind machine and guard, which must have native code."""
        self._rig, self._period, self._guard, self._gain = rig, period, guard, gain
        self._record = guard.envelope.record
        joints = len(gain)
        self._tau_measured, self._tau_commanded = np.empty(joints), np.empty(joints)
        self._no_torque = np.full(joints, np.nan)
        self._no_torque.flags.writeable = False
        self._scratch = np.empty(len(SCALARS) + 1 + joints * len(JOINT_FIELDS))
        """Row of a tick that is not recorded."""
        self._step = step = record.LockStep()
        self._tick, self._address = library.lock_step_tick, ctypes.addressof(step)
        self._kept: tuple[object, ...] = ()  # the record holds addresses only
        self._law: NativeLaw | None = None
        self._bound: object = None
        self._write_machine()

    @classmethod
    def of(cls, rig: Rig, guard: Guard, gain: Joints) -> "NativeTicks | None":
        """Return the ticks of a machine behind its guard; None if one of them has no native code."""
        is_plain = type(guard) is Guard
        if LIBRARY is None or guard.envelope.record.library is None or not is_plain:
            return None
        if not isinstance(rig, NativelySimulated) or (period := rig.native_period) is None:
            return None
        return cls(rig, period, LIBRARY, guard, gain)

    def begin(self, feedback: OutputFeedback, controller: Controller, path: Trajectory) -> bool:
        """Bind a controller and a path. False if a tick needs Python, as the first ones of a controller do."""
        observer = feedback.observer
        if type(feedback) is not OutputFeedback or not observer.is_started or observer.native is None:
            return False
        law: NativeLaw | None = getattr(controller, "native_law", None)
        if law is None:
            return False
        tables = tuple(np.ascontiguousarray(one, dtype=float) for one in (path.q, path.v, path.a))
        step, self._feedback, self._controller, self._law = self._step, feedback, controller, law
        step.observer, step.observer_memory = observer.native.function, observer.native.memory
        step.q_measured, step.q_observed, step.v_observed = map(_address, (observer.measured, observer.q, observer.v))
        step.q_path, step.v_path, step.a_path = map(_address, tables)
        self._write_law(law)
        # Numbers of the mode are read in each tick, because listeners change them.
        self._mode = None if law.mode is None else getattr(controller, "mode", None)
        if self._mode is None:
            step.drive, step.gravity_level, step.arm_share = NO_MODE
        self._kept = tables, law, observer
        return True

    @property
    def is_ready(self) -> bool:
        """True if the next tick may run in native code: its measurement was not read yet."""
        return self._rig.is_unread

    @property
    def may_run(self) -> bool:
        """True if the next tick of a session may run in native code: it is ready, and no stop is in force."""
        return self.is_ready and self._guard.envelope.stop is None

    def run(self, k: int, reference: Reference, acts: int, recording: RecordingWriter | None) -> JointState | None:
        """Run the tick of row `k` of the path; return the measurement, or None if the guard does not trust it.

        Raises:
            RigError: The simulation has diverged, or the guard let a command through that is not finite.
        """
        step, guard_record = self._step, self._record
        t, step.sequence, step.noise_row, step.muscle_row = self._rig.begin_native()
        step.tick, step.t, step.acts = k, t, acts
        if (mode := self._mode) is not None:
            step.drive, step.gravity_level, step.arm_share = mode.drive, mode.gravity_level, mode.arm_share
        if self._bound is not guard_record.tick:  # another person, with another table
            step.guard, step.table = guard_record.memory()
            self._bound = guard_record.tick
        if recording is not None:
            step.control, step.phase = recording.count("/control"), recording.phase_number
            step.row = recording.next_row()
        self._feedback.controller, self._feedback.reference, self._feedback.guide = self._controller, reference, None
        result = self._tick(self._address)
        if result == record.NOT_FINITE:
            self._refuse(t)
        self._rig.end_native(result == record.DIVERGED)
        if recording is not None:
            recording.end_row()
        if not step.is_usable:
            return None
        q, current, q_motor = self._period.measured
        # Copies: listeners keep measurements.
        of_motor = None if q_motor is None else q_motor.copy()
        return JointState(t, step.sequence, q.copy(), current.copy(), self._no_torque, _BY_CURRENT, of_motor)

    @property
    def tick_us(self) -> float:
        """Computing time of the last decision, guard included [µs]."""
        return self._step.tick_us

    @property
    def tau_measured(self) -> Joints:
        """Measured torque of the last tick [N·m]; overwritten in each tick."""
        return self._tau_measured

    @property
    def tau_commanded(self) -> Joints:
        """Commanded torque of the last tick [N·m]; overwritten in each tick."""
        return self._tau_commanded

    def _refuse(self, t: float) -> None:
        """Let the machine refuse a current that is not finite, in its own words."""
        tau = self._tau_commanded
        self._rig.write(Command(t, self._step.sequence, t + COMMAND_LIFE_S, tau, tau / self._gain))

    def _write_machine(self) -> None:
        """Write sizes, functions and addresses of buffers to the record of the C code; they never change afterwards."""
        step, period, guard_record = self._step, self._period, self._record
        library = guard_record.library
        assert library is not None
        step.joints, step.substeps, step.velocities = len(self._gain), period.substeps, len(period.velocity)
        step.sensors, step.sensors_memory = period.sensors.function, period.sensors.memory
        step.noise, step.noise_now = map(_address, (period.noise, period.noise_now))
        q, current, q_motor = period.measured
        step.q, step.current, step.has_motor = _address(q), _address(current), q_motor is not None
        # Without encoders on the motors, the row of a recording takes NaN from here.
        step.q_motor = _address(self._no_torque if q_motor is None else q_motor)
        step.forces, step.forces_memory = period.forces.function, period.forces.memory
        step.first_half, step.second_half = period.halves
        step.model, step.data = period.engine
        step.velocity, step.current_in, step.damping_in, step.valid_until_in = map(
            _address, (period.velocity, period.current, period.damping, period.valid_until)
        )
        step.arms = len(period.muscles)
        for place, muscles in zip(step.arm, period.muscles, strict=False):
            place.freedoms = muscles.torques.shape[1]
            place.torques, place.now = _address(muscles.torques), _address(muscles.now)
        step.poles = len(period.poles)
        for place, pole in zip(step.pole, period.poles, strict=False):
            for name in ("abduction", "inertia", "engine_damping", "velocity", "forces", "is_near"):
                setattr(place, name, _address(getattr(pole, name)))
            place.places[:], place.turning[:], place.damping[:] = pole.places, pole.turning, pole.damping.tolist()
            place.damping_step = pole.damping_step
            place.stable_share, place.far_cosine = pole.stable_share, pole.far_cosine
        step.see, step.decide = (
            ctypes.cast(function, ctypes.c_void_p).value for function in (library.guard_see, library.guard_decide)
        )
        step.gain, step.tau_measured, step.tau_commanded, step.row = map(
            _address, (self._gain, self._tau_measured, self._tau_commanded, self._scratch)
        )
        step.command_life = COMMAND_LIFE_S

    def _write_law(self, law: NativeLaw) -> None:
        step = self._step
        step.law, step.law_memory = (None, None) if law.call is None else (law.call.function, law.call.memory)
        names = "law_q", "law_v", "law_q_reference", "law_v_reference", "law_a_reference"
        for name, memory in zip(names, law.inputs, strict=False):
            setattr(step, name, _address(memory))
        step.mode, step.slope = (None if one is None else _address(one) for one in (law.mode, law.slope))
        step.tau_desired, step.tau_feedforward = map(_address, (law.tau_desired, law.tau_feedforward))
        step.ramps = len(law.ramps)
        for place, (ramp, written) in zip(step.ramp, law.ramps, strict=False):
            place.size, place.counts = len(ramp.x), ramp.counts.buffer_info()[0]
            place.start, place.goal, place.x, place.written = map(_address, (ramp.start, ramp.goal, ramp.x, written))


def _address(memory: np.ndarray) -> int:
    """Address of contiguous numbers."""
    return memory.__array_interface__["data"][0]
