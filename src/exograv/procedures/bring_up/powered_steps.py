"""Bring-up steps with motor torque, at low limits: push, guided motion, stop button, watchdog and weighing."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.control.exo_tick import most_damping
from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import RigError
from exograv.identification.calibration.empty_machine import GAIN_SD
from exograv.identification.calibration.empty_prior import COULOMB, usual_friction
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot, Progress
from exograv.loop.tick_sample import TickSample
from exograv.model.description import JointSweep, RigDescription
from exograv.model.tree import Tree
from exograv.motion import go_to, hold
from exograv.procedures.calibration.breakaway_test import BreakawayTester, starting_posture
from exograv.procedures.calibration.calibrate import CHECK_WAY, SLOW, to_and_fro
from exograv.procedures.calibration.empty_run import TRAVEL, EmptyRun
from exograv.procedures.calibration.known_weights import LOADED_NM, carrying_share
from exograv.procedures.calibration.phase_texts import say
from exograv.procedures.self_test.recording_rig import PoweredRecordingRig
from exograv.rig.drive_status import DriveFault, DriveStatus
from exograv.rig.drives.opening import DrivenRig
from exograv.rig.drives.settings import Drives
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.envelope import Envelope
from exograv.signals import JointState
from exograv.storage.self_test_step import Step, within

from .bench_machine import BenchMachine
from .hands import Hands
from .unpowered_steps import WATCHDOG_WITHIN_MS, is_released

LOW = 0.5
"""Share of the motors' torque limit that a bring-up may use, if the machine and the lightest known weight need less."""

LIGHT_RUNNING = 10.0
"""Torque that carries the machine with the lightest known weight over usual friction, from which the machine is led to
where it hangs after each step [-]. Harmonic drives have 9 at most; with fewer motions their steps take less time."""

SPARE = 1.25
"""Torque that a bring-up may use over that which carries a heavy machine with the lightest known weight [-]."""

LED_SHARE = 0.7  # share of the tracking error at which the run stops
GONE_SHARE, GONE_NM = 0.1, 0.7
"""Torque below which a motor counts as off: share of the earlier torque, and torque [N·m], whichever is larger. The
torque of the brake is excluded, as in the self-test."""

SMOOTH_TICKS = 5
OFF_WITHIN_MS = 50.0  # docs/explanation/safety.md, F30
FALLS_MAX_RAD_S = 1.5
"""Largest speed of a machine that its drives brake [rad/s]. In free fall the speed would be twice as high within the
time watched."""

FALLS = (
    "The machine falls: without torque its drives do not brake, or too weakly for its weight. No person may be in it. "
    "Use drives that brake more strongly (brake_Nms_per_rad in drives.toml is the measured damping), or carry a part "
    "of the weight by springs or a counterweight."
)
LOADED_RAD = 0.6
"""Angle by which the machine is raised from the hanging posture, so that its motors carry a load [rad]."""

AFTER_S = 1.0
SCALE_MAX = 0.15  # docs/explanation/safety.md, F09

Rows = Float[np.ndarray, "tick joint"]


def bring_up_share(description: RigDescription, tree: Tree) -> Float[np.ndarray, " joint"]:
    """Share of the motors' torque limit that a bring-up may use (joint,) [-]: `LOW`, or more in a heavy machine."""
    return np.clip(SPARE * carrying_share(description, tree), LOW, 1.0)


class Logged(PoweredRecordingRig):
    """Rig that also logs the status of the drives at each reading."""

    def __init__(self, rig: DrivenRig):
        super().__init__(rig)
        self.said: list[tuple[float, tuple[DriveStatus, ...]]] = []
        """Time of each reading on the rig's clock [s], and status of the drives."""

    def read(self) -> JointState:
        """Read the joint state, and log the status of the drives."""
        state = super().read()
        self.said.append((self.t, self.status()))
        return state

    def first(self, fault: DriveFault) -> float:
        """First time at which every drive reported this fault [s]; infinite if it did not happen."""
        for t, status in self.said:
            if all(fault in drive.fault for drive in status):
                return t
        return np.inf


@dataclass
class PoweredSteps:
    """Bring-up steps in which the motors give torque."""

    description: RigDescription
    tree: Tree
    line: BenchMachine
    drives: Drives
    hands: Hands
    progress: Progress

    def __post_init__(self):
        nominal = self.description.nominal_gain
        self._gains = ActuatorGain(nominal, GAIN_SD * nominal)
        worn = limits(self.description)
        damping = np.minimum(worn.damping_Nms_per_rad, most_damping(self.description, self.tree))
        share = bring_up_share(self.description, self.tree)
        carried = carrying_share(self.description, self.tree) * self.description.per_actuator("torque_max_Nm")
        self._falls_freely = bool((carried > LIGHT_RUNNING * usual_friction(self.description, COULOMB)[0]).any())
        self._limits = replace(worn, torque_max_Nm=share * worn.torque_max_Nm, damping_Nms_per_rad=damping)
        self._brake = np.array([drive.brake_Nms_per_rad for drive in self.drives.each])
        self.log = Logged(self.line.rig)
        self.run = EmptyRun(self.description, self.tree, self._pilot(), self.hands.weights)

    def _pilot(self) -> Pilot:
        rig = self.log
        envelope = Envelope(self._limits, rig.period_s)
        pace = None if self.line.lock_step else RealTimePace(rig.period_s)
        return Pilot(rig, self._gains, envelope, progress=self.progress, pace=pace)

    def begin(self) -> None:
        # Each step has a guard of its own: a stop in one step must not end the next.
        """Start a new log and a new guard for the next step."""
        self.log = Logged(self.line.rig)
        self.run.pilot = self._pilot()

    def nudges(self) -> list[Step]:
        """Push each joint with growing torque until it moves.

        The joint must move along the push, alone, and at a torque that friction explains.
        """
        self.begin()
        friction = BreakawayTester(self.run).nudge(pushes=1)
        most = LOW * self.description.per_actuator("torque_max_Nm")
        names = self.description.joints
        return [
            within(
                f"{name}: moves along a nudge of",
                float(tau),
                float(top),
                "N·m",
                "The joint needs too much torque to move.",
            )
            for name, tau, top in zip(names, friction, most, strict=True)
        ]

    def leads(self, joint: int) -> list[Step]:
        """Move one joint slowly forth and back by feedback, with the other joints held."""
        self.begin()
        farthest = 0.0

        def listener(moment: TickSample) -> None:
            nonlocal farthest
            self.run.listen(moment)
            farthest = max(farthest, float(np.abs(moment.reference.q - moment.q)[joint]))

        plan = self._plan(joint)
        path = to_and_fro(self.run, plan, SLOW, way=CHECK_WAY)
        name = self.description.joints[joint]
        self.run.pilot.run(self.run.controller, path, f"Moving {name}", listener)
        self._hang()
        limit = LED_SHARE * float(np.rad2deg(self.run.astray_rad[joint]))
        what = f"'{name}' lags: its torque is lower than commanded, or its friction higher than usual for its drive."
        return [within(f"{name}: follows a slow motion within", float(np.rad2deg(farthest)), limit, "°", what)]

    def stops(self) -> list[Step]:
        """Ask for a press of the hardware stop while the motors carry the machine."""
        pressed = [np.inf]

        def press(t: float) -> None:
            pressed[0] = t
            self.hands.press_stop()

        self._raised("Stop is pressed", press, self.hands.patience_s)
        heard, what = (
            self.log.first(DriveFault.STOP_LINE),
            "Check the wiring of the stop line and that it cuts the power (STO).",
        )
        off = self._gone(heard)
        is_released(self.line, self.hands)
        return [
            Step("hardware stop under torque: heard by", bool(np.isfinite(heard)), "all" if np.isfinite(heard) else
                 "not all", "all", "drives", "" if np.isfinite(heard) else what),
            within("hardware stop under torque: motors off after", 1e3 * off, OFF_WITHIN_MS, "ms", what),
            within("hardware stop under torque: sinks at", self._falls(heard), FALLS_MAX_RAD_S, "rad/s", FALLS),
        ]  # fmt: skip

    def falls_silent(self) -> list[Step]:
        """Stop all commands while the motors carry the machine."""
        silent = [np.inf]

        def fall_silent(t: float) -> None:
            silent[0] = t
            self.log.is_silent = True

        self._raised("No commands are sent", fall_silent, 0.5)
        self.log.is_silent = False
        what = "Set the drives' watchdogs to 20 ms and to braking (docs/explanation/safety.md)."
        off = self._gone(silent[0])
        return [
            within("watchdog under torque: motors off after", 1e3 * off, WATCHDOG_WITHIN_MS + 10.0, "ms", what),
            within("watchdog under torque: sinks at", self._falls(silent[0]), FALLS_MAX_RAD_S, "rad/s", FALLS),
        ]

    def weighs(self, joint: int) -> list[Step]:
        """Measure a known weight by motor current on a slow pass there and back."""
        self.begin()
        plan = self._plan(joint)
        mount = plan.mount or self.description.calibration.mount
        without = self._pass(joint)
        self.run.load(mount, 0)
        loaded = self._pass(joint)
        self.run.load(mount, None)
        self._hang()
        felt, expected = loaded[0] - without[0], loaded[1] - without[1]
        name = self.description.joints[joint]
        mass = self.description.calibration.weights_kg[0]
        if np.abs(expected).max() < LOADED_NM:  # `rig check` allows it for a vertical axis only
            return [Step(f"{name}: is vertical, so that {mass:g} kg does not load it", True, "not weighed")]
        scale = float(felt @ expected / (expected @ expected))
        what = (
            f"By its current the motor of '{name}' carries {scale:.2f} times {mass:g} kg. Correct current_rated_A in "
            "drives.toml (a wrong unit gives a factor of 1000, peak for RMS 1.4), or torque_constant_Nm_per_A or "
            "gear_ratio in rig.toml. If the factor is negative, the signs of current and encoder are both reversed."
        )
        passed = abs(scale - 1.0) <= SCALE_MAX
        return [Step(f"{name}: weighs {mass:g} kg as", passed, round(scale, 3), "0.85 to 1.15", "times that",
                     "" if passed else what)]  # fmt: skip

    def _plan(self, joint: int) -> JointSweep:
        plans = self.description.calibration.sweeps
        return next(plan for plan in plans if plan.joint == self.description.joints[joint])

    def _pass(self, joint: int) -> tuple[Float[np.ndarray, " place"], Float[np.ndarray, " place"]]:
        """Torque by current and by model [N·m] at places on a slow pass, mean of both directions."""
        rows: list[tuple[float, float, float, float]] = []

        def listener(moment: TickSample) -> None:
            self.run.listen(moment)
            rows.append((moment.reference.v[joint], moment.q[joint], moment.tau_measured[joint],
                         moment.tau_feedforward[joint]))  # fmt: skip

        text = f"Weighing by {self.description.joints[joint]}"
        self._go(joint, 0.0, text)
        path = to_and_fro(self.run, self._plan(joint), SLOW)
        self.run.pilot.run(self.run.controller, path, text, listener)
        v, q, *taus = np.array(rows).T
        moving = np.abs(v) > 0.5 * SLOW
        first, last = np.quantile(q[moving], [0.15, 0.85]).tolist()
        places = np.linspace(first, last, 12)
        return tuple(
            np.mean([_at(places, q[way], tau[way]) for way in (moving & (v > 0.0), moving & (v < 0.0))], axis=0)
            for tau in taus
        )  # pyright: ignore[reportReturnType]

    def _go(self, joint: int, beyond: float, text: str) -> None:
        """Move the machine to the start of a joint's sweep, and `beyond` [rad] into the sweep."""
        plan, dt = self._plan(joint), self.run.pilot.rig.period_s
        goal = np.deg2rad(plan.posture_deg)
        goal[joint] = np.deg2rad(plan.from_deg) + np.copysign(beyond, plan.to_deg - plan.from_deg)
        self.run.follow(go_to(self.run.pilot.q.copy(), goal, SLOW, dt), text)

    def _hang(self) -> None:
        """Lead the machine to where it hangs, if its friction is light.

        The next step begins without torque, and a raised machine would fall.
        """
        if not self._falls_freely:
            return
        home = go_to(self.run.pilot.q.copy(), starting_posture(self.tree), TRAVEL, self.run.pilot.rig.period_s)
        self.run.follow(home, say("calibration.home"))

    def _raised(self, text: str, act: Callable[[float], None], seconds: float) -> None:
        """Raise the machine so that its motors carry a load, then call `act` and hold for `seconds` more."""
        self.begin()
        run, ticks = self.run, 0
        self._go(0, LOADED_RAD, "Raising the machine")
        path = hold(run.pilot.q.copy(), seconds + AFTER_S, run.pilot.rig.period_s)

        def listener(_moment: TickSample) -> None:
            nonlocal ticks
            ticks += 1
            if ticks == 1:
                act(run.pilot.rig.t)

        try:
            run.pilot.run(run.controller, path, text, listener)
        except RigError:
            return

    def _gone(self, since: float) -> float:
        """Time until every motor is off [s]; infinite if one never is.

        A motor is off below a tenth of its earlier torque. The torque of the brake is not counted.
        """
        passed = self.log.passed(0)
        after = passed.t > since
        if not (after.any() and (~after).any()):
            return np.inf
        tau = self.description.nominal_gain * passed.current
        before = np.abs(tau[~after][-50:]).max(axis=0)
        v = np.gradient(passed.q, passed.t, axis=0)
        left = np.abs(_smooth(tau + self._brake * v))[after]
        small = (left < np.maximum(GONE_SHARE * before, GONE_NM)).all(axis=1)
        return float(passed.t[after][small.argmax()] - since) if small.any() else np.inf

    def _falls(self, since: float) -> float:
        """Largest joint speed after `since` [rad/s]; infinite without enough samples."""
        passed = self.log.passed(0)
        after = passed.t > since
        if np.count_nonzero(after) < 20:
            return np.inf
        t, q = passed.t[after], passed.q[after]
        return float(np.abs((q[10:] - q[:-10]) / (t[10:] - t[:-10])[:, None]).max())


def _smooth(rows: Rows) -> Rows:
    """Return the moving average over the last `SMOOTH_TICKS` ticks."""
    sums = np.cumsum(np.vstack([np.zeros((SMOOTH_TICKS, rows.shape[1])), rows]), axis=0)
    return (sums[SMOOTH_TICKS:] - sums[:-SMOOTH_TICKS]) / SMOOTH_TICKS


def _at(places: Float[np.ndarray, " place"], q: Float[np.ndarray, " tick"], tau: Float[np.ndarray, " tick"]):
    order = q.argsort()
    return np.interp(places, q[order], tau[order])
