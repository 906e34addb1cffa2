"""Run of the empty machine: motion along references, known weights, limit of the tracking error, and samples."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.control.exo_tick import ExoTick, empty_gains
from exograv.dynamics.loop_torque import GRAVITY
from exograv.errors import IdentificationError, RigError
from exograv.identification.calibration.empty_machine import SAMPLE_PERIOD_S, V_CLEAR, V_START, Sweeps
from exograv.identification.calibration.empty_model import FILTER_DELAY_S
from exograv.identification.core.sample_filter import SampleFilter
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.motion import Trajectory, go_to, hold
from exograv.rig import Powered
from exograv.safety.stops import StopReason

from .operator import ComputedOperator, Operator
from .phase_texts import say

ASTRAY_RAD = np.deg2rad(8.0)
"""Tracking error that is always allowed [rad]. Friction, a wrong gain and a weight make the PD deviate by 5° at most.
"""
ASTRAY_SHARE = 1.0 / 3.0
"""Share of the motor's torque. The PD of a light joint reaches it only at a larger error; a blocked joint reaches any
error."""
WEIGHT_EVENT, WEIGHT_TEXT = "weight", "{mass:g} kg at {mount}"
"""Event of a recording from which on a known weight hangs at a mount; 0 kg after it is taken off."""
WARMTH_EVENT, WARMTH_EVERY_S = "temperature", 5.0
"""Event of a recording with the temperatures of the windings in the order of the joints [°C], and the time between two.
They change within minutes."""
HOT_C = 80.0
"""Temperature of a winding from which a message states it [°C]: that of a usual motor at its rated current."""
WARM_C, COOLED_C = 55.0, 40.0
"""Temperature of a winding from which no pass begins, and temperature at which the machine goes on [°C]. One pass at
twice the rated current heats the winding of a small motor by 40 °C, and drives give less torque from about 95 °C on."""
COOLING_MAX_S, COOLING_STEP_S = 300.0, 5.0
"""Longest wait for a winding to cool down, and time between two looks at it [s]. A motor that is no cooler then stands
in a warm room, or carries load in the hanging posture."""
LOWER_STEP_S = 0.02  # between two steps in which a weight is lowered
WAIT_S = 0.1  # between two checks whether the operator is ready
TRAVEL = 0.8
"""Speed of the machine between two postures [rad/s]."""
CLOSER = "give the sweep a posture_deg in rig.toml in which this joint is closer to hanging"

Joints = Float[np.ndarray, " joint"]


@dataclass
class EmptyRun:
    """Run of a calibration or re-check. The tree must be set to the lengths of the machine."""

    description: RigDescription
    tree: Tree
    pilot: Pilot
    operator: Operator = field(default_factory=lambda: ComputedOperator(lambda _mount, _mass: None))
    """Operator who hangs the weights; by default no weight is hung."""
    gravity: Float[np.ndarray, " 3"] = field(default_factory=GRAVITY.copy)
    """Gravity vector in the base frame, after a calibration has found the lean of the base [m/s²]."""

    def __post_init__(self):
        self.controller = ExoTick(self.description, self.tree, self.gravity)
        self.filter = SampleFilter(len(self.description.joints), self.pilot.rig.period_s, FILTER_DELAY_S)
        """Filter of the samples; its torque is the motor current [A]."""
        kp, _ = empty_gains(self.description, self.tree)
        torque_max = self.description.per_actuator("torque_max_Nm")
        self.astray_rad = np.maximum(ASTRAY_RAD, ASTRAY_SHARE * torque_max / kp)
        """Largest allowed distance from the reference (joint,) [rad]."""
        weights = len(self.description.calibration.weights_kg)
        self._hung = np.zeros((len(self.description.mounts), weights))
        self._rows: list[tuple[float | bool | np.ndarray, ...]] = []
        self._every = round(SAMPLE_PERIOD_S / self.pilot.rig.period_s)
        self._ticks = 0
        self._warmth_next_s = -np.inf

    def listen(self, moment: TickSample) -> None:
        """Filter one tick, and keep a sample every `SAMPLE_PERIOD_S` while a joint moves."""
        sample = self.filter.update(moment.state.q, moment.state.current)
        self._ticks += 1
        if moment.state.t >= self._warmth_next_s:
            self._record_warmth(moment.state.t)
        if self._ticks % self._every == 0 and self.filter.settled and np.abs(sample.v).max() > V_CLEAR:
            columns = (sample.q.copy(), sample.v.copy(), sample.a.copy(), sample.tau.copy())
            self._rows.append((moment.state.t, *columns, self._hung.ravel().copy(), False))

    def note_start(self, t: float, joint: int, sign: float, q: Joints, current: Joints) -> None:
        """Store the current [A] that moved a joint from rest at `q` [rad], upwards (1) or downwards (-1)."""
        v = np.zeros(len(q))
        v[joint] = sign * V_START
        self._rows.append((t, q, v, np.zeros(len(q)), current, self._hung.ravel().copy(), True))

    def sweeps(self) -> Sweeps:
        """Return the samples of all motions of the run."""
        columns = [np.array(column) for column in zip(*self._rows, strict=True)]
        return Sweeps(*columns)

    def follow(self, path: Trajectory, text: str) -> None:
        """Move the machine along a path from its present posture.

        Raises:
            IdentificationError: A joint did not follow; the machine has come down softly.
            RigError: The envelope stopped the run.
        """
        watch = _Watch(self, path)
        self._run(self.controller, path, text, watch)
        if watch.astray is not None:
            joint, led, stands = watch.astray
            warm = self._winding(joint)
            raise IdentificationError(
                f"Joint '{self.description.joints[joint]}' is at {np.rad2deg(stands):.1f}° where its reference is "
                f"{np.rad2deg(led):.1f}°; {np.rad2deg(self.astray_rad[joint]):.0f}° are allowed. It may be blocked, "
                "its motor disconnected, its encoder and motor both reversed, or the weight another than stated."
                f"{warm} "
                "The machine has come down. Free the joint, or correct the fault, and repeat."
            )

    def _run(self, controller: Controller, path: Trajectory, text: str, watch: "_Watch") -> None:
        try:
            self.pilot.run(controller, path, text, watch)
        except RigError as error:
            if watch.astray is None:
                fastest = max(watch.fastest)
                joint = self.description.joints[watch.fastest.index(fastest)]
                raise RigError(
                    f"{error} The fastest joint was '{joint}' with {fastest:.1f} rad/s; its "
                    "encoder's unit or sign, or its stiffness in rig.toml, may be wrong."
                ) from error

    def load(self, mount: str, weight: int | None) -> None:
        """Ask the operator to hang a known weight (by its number) on a mount, or to take the present weight off."""
        k = self.description.mounts.index(mount)
        weights = np.array(self.description.calibration.weights_kg)
        before = float(self._hung[k] @ weights)
        after = 0.0 if weight is None else float(weights[weight])
        dt, passed, lowers_s = self.pilot.rig.period_s, 0, self.operator.lowers_s
        ticks, every = round(lowers_s / dt), max(round(LOWER_STEP_S / dt), 1)

        def become(mass: float) -> None:
            self.controller.hang(mount, mass)
            self.operator.lower(mount, mass)

        def wait(moment: TickSample) -> None:
            self.filter.update(moment.state.q, moment.state.current)

        def lower(moment: TickSample) -> None:
            nonlocal passed
            passed += 1
            if passed % every == 0 and passed < ticks:
                become(before + (after - before) * passed / ticks)
            wait(moment)

        if after != before:
            q, text = self.pilot.q.copy(), say("calibration.hang", weight=f"{after:g}")
            while not self.operator.is_ready(mount, after):
                self.pilot.run(self.controller, hold(q, WAIT_S, dt), text, wait)
            self.pilot.run(self.controller, hold(q, lowers_s, dt), text, lower)
            # The time need not be a multiple of the step, and the listener skips ticks without a measurement.
            become(after)
            self._record_weight(mount, after)
        self._hung[k] = 0.0
        if weight is not None:
            self._hung[k, weight] = 1.0

    def cool(self, posture: Joints) -> None:
        """Move to `posture` [rad] and wait there until no winding is warm. Drives without a sensor are not waited for.

        Args:
            posture: Posture in which the machine hangs, so that its motors carry little (joint,) [rad].

        Raises:
            As `follow`.
        """
        joint, celsius = self._warmest()
        if not celsius > WARM_C:
            return
        dt = self.pilot.rig.period_s
        text = say("calibration.cool", motor=self.description.joints[joint], celsius=f"{celsius:.0f}")
        self.follow(go_to(self.pilot.q.copy(), posture, TRAVEL, dt), text)
        for _ in range(round(COOLING_MAX_S / COOLING_STEP_S)):
            if self._warmest()[1] <= COOLED_C:
                return
            self.follow(hold(posture, COOLING_STEP_S, dt), text)

    def _warmest(self) -> tuple[int, float]:
        """Return the joint with the warmest winding and its temperature [°C]; NaN without a sensor."""
        celsius = self._temperatures()
        if np.isnan(celsius).all():
            return 0, np.nan
        joint = int(np.nanargmax(celsius))
        return joint, float(celsius[joint])

    def _temperatures(self) -> Joints:
        """Temperatures of the windings (joint,) [°C]; NaN where a drive does not measure it."""
        rig = self.pilot.rig
        if not isinstance(rig, Powered):
            return np.full(len(self.description.joints), np.nan)
        return np.array([drive.temperature_C for drive in rig.status()])

    def _winding(self, joint: int) -> str:
        """Return a sentence with the temperature of a hot winding, which a drive protects by less torque."""
        celsius = self._temperatures()[joint]
        if celsius < HOT_C or np.isnan(celsius):
            return ""
        # Without a weight the links alone are too much for this motor in this posture.
        lighter = "use lighter weights (calibration.weights_kg in rig.toml)" if self._hung.any() else CLOSER
        return f" Its motor is at {celsius:.0f} °C: the drive may give less torque. Let it cool down, and {lighter}."

    def _record_warmth(self, t: float) -> None:
        """Note the temperatures of the windings in the recording, if the drives measure them."""
        self._warmth_next_s = t + WARMTH_EVERY_S
        recording = self.pilot.recording
        if recording is None:
            return
        celsius = self._temperatures()
        if np.isfinite(celsius).any():
            text = " ".join(f"{value:.1f}" for value in celsius)
            recording.write("/event", t, {"kind": WARMTH_EVENT, "text": text})

    def _record_weight(self, mount: str, mass: float) -> None:
        """Note the weight in the recording, for a later fit of the machine's twin."""
        recording = self.pilot.recording
        if recording is not None:
            text = WEIGHT_TEXT.format(mass=mass, mount=mount)
            recording.write("/event", self.pilot.rig.t, {"kind": WEIGHT_EVENT, "text": text})


class _Watch:
    """Listener of one path: keeps samples, and stops a machine that does not follow."""

    def __init__(self, run: EmptyRun, path: Trajectory):
        self._run, self._asked = run, iter(path.q.tolist())
        # Lists: for a handful of joints NumPy takes ten times as long.
        self._allowed, self.fastest = run.astray_rad.tolist(), [0.0] * len(run.description.joints)
        self.astray: tuple[int, float, float] | None = None
        """Joint, its reference and its position [rad], where the error was too large."""

    def __call__(self, moment: TickSample) -> None:
        self._run.listen(moment)
        asked, q, fastest, is_near = next(self._asked), moment.q.tolist(), self.fastest, True
        for joint, v in enumerate(moment.v.tolist()):
            if not -fastest[joint] <= v <= fastest[joint]:
                fastest[joint] = max(fastest[joint], abs(v))
            is_near = is_near and abs(asked[joint] - q[joint]) <= self._allowed[joint]
        if not is_near:
            self._judge(asked, q)

    def _judge(self, asked: list[float], q: list[float]) -> None:
        """Stop the machine where the joint that is farthest from its reference is too far away."""
        apart = [abs(a - b) / most for a, b, most in zip(asked, q, self._allowed, strict=True)]
        worst = max(apart)
        if worst > 1.0 and self._run.pilot.envelope.stop is None:
            joint = apart.index(worst)
            self.astray = joint, asked[joint], q[joint]
            self._run.pilot.envelope.trip(StopReason.ASTRAY)
