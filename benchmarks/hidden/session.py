"""Recordings of a hidden machine: exograv's own loop and controller of the empty machine drive it along a plan."""

import csv
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.rig_settings import Excitation
from exograv.model.tree import Tree
from exograv.motion import Trajectory, go_to, hold, joined
from exograv.procedures.calibration.breakaway_test import BreakawayTester, starting_posture
from exograv.procedures.calibration.calibrate import CREEP, FAST, SLOW, TRAVEL, to_and_fro
from exograv.procedures.calibration.empty_motion import empty_motion
from exograv.procedures.calibration.empty_run import EmptyRun
from exograv.recording import RecordingWriter, read_recording
from exograv.safety.envelope import Envelope
from exograv.signals import Joints, Reference

from .draw import Hidden, Wrench
from .geometry import Geometry
from .pulls import ForceSensor, Operator
from .rig import HiddenRig

RIG = "recupera_like"
GAIN_SD = 0.1
"""Relative standard deviation of the gains of the data sheet [-]."""


@dataclass(frozen=True)
class Sines:
    """Kind of a sum of sines."""

    lowest_Hz: float
    highest_Hz: float
    v_max: float
    """Largest speed [rad/s]."""
    a_max: float
    """Largest acceleration [rad/s²]."""


WIDE = Sines(0.05, 0.9, 1.4, 8.0)
"""Motion through the workspace, which shows weight and friction."""
FAST_SINES = Sines(0.8, 2.5, 1.2, 14.0)
"""Motion with large accelerations, which shows inertia: elsewhere friction at the reversals hides it."""
STEP_NM = 4.0
"""Largest step of torque beside the controller's [N·m]."""
STEP_S = 0.06, 0.4
"""Shortest and longest time between two steps [s]."""
RELEASED_DEG = (15.0, 10.0, 5.0, 40.0)
"""Posture in which the machine is released."""
RELEASES = 3
FORCE_COLUMNS = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
"""Columns of the force sensor [N, N·m]: on the machine, at the origin and in the axes of the calibration mount."""
PULLED_S = 75.0
"""Time for which the operator pulls [s]."""
PULLED = Sines(0.03, 0.25, 0.5, 2.0)
"""Motion through the workspace while the operator pulls."""
HELD_OUT_WIDE = 0.75
"""Share of wide motion in the held-out recording [-]."""


@dataclass
class Notes:
    """Events of a recording that a laboratory would write down: phases, weights and their times."""

    entries: list[dict[str, object]] = field(default_factory=list)

    def add(self, t: float, **values: object) -> None:
        """Add an entry at a time of the rig's clock [s]."""
        self.entries.append({"t": round(t, 4), **values})


@dataclass
class NotedBench:
    """Operator who hangs weights on a hidden machine and writes them down."""

    rig: HiddenRig
    notes: Notes
    recording: RecordingWriter
    weight_kg: float
    """Only weight of the session [kg]."""
    lowers_s: float = 1.0
    is_lowering: bool = False

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Return True: the bench is always ready."""
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """Hang this mass on the mount."""
        self.rig.hang(mount, mass_kg)
        is_whole = mass_kg in (0.0, self.weight_kg)
        if is_whole or not self.is_lowering:
            text = f"{mass_kg:g} kg on {mount}" if is_whole else f"a weight is lowered onto {mount}, or taken off"
            self.notes.add(self.rig.t, mount=mount, **({"weight_kg": mass_kg} if is_whole else {"lowering": True}))
            self.recording.write("/event", self.rig.t, {"kind": "note", "text": text})
        self.is_lowering = not is_whole


class Beside:
    """Controller that adds a torque to another controller's, or replaces it by none."""

    def __init__(self, controller: Controller, added: Joints):
        self._controller = controller
        self.added, self.share = added, 1.0
        """Added torque [N·m], and share of the other controller's torque [-]."""
        self.closure_slope, self.clearance = 0.0, 1.0

    @property
    def tau_feedforward(self) -> Joints:
        """Motor torque as the model expects it [N·m]."""
        return self.share * self._controller.tau_feedforward

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Return the torque of both (joint,) [N·m]."""
        return self.share * self._controller.step(q, v, reference) + self.added


class Session:
    """Motions of one hidden machine, in one recording after the other on one clock."""

    def __init__(self, geometry: Geometry, drawn: Callable[[Joints], Hidden], ran_s: float = 0.0):
        """Hang the machine that `drawn` returns for the gains of the data sheet [N·m/A], and switch it on.

        The machine has run for `ran_s` [s] before.
        """
        self.description: RigDescription = load_rig(RIG, "right")
        nominal = {each.segment: each.nominal_m for each in self.description.settings.adjustments}
        self.tree: Tree = adjusted(read_exoskeleton(self.description), self.description, nominal)
        self.hidden = drawn(self.description.nominal_gain)
        """Machine with its true values."""
        self.rig = HiddenRig(geometry, self.hidden, starting_posture(self.tree), ran_s)
        self.mean_gain: dict[str, Joints] = {}
        """Mean gain in each recording, by its name, weighted by the square of the current [N·m/A]."""

    def record(self, path: Path, rng: np.random.Generator, held_out_s: float | None = None, plans: int = 1) -> Notes:
        """Write the recording of the plan, or of held-out motion of this duration [s], with notes and a CSV table.

        The plan is flown `plans` times.
        """

        def fly(part: _Part) -> None:
            if held_out_s is None:
                for number in range(plans):
                    if number:
                        part.go_home()
                    part.plan()
            else:
                part.sines("held_out", HELD_OUT_WIDE * held_out_s, WIDE)
                part.sines("held_out_fast", (1.0 - HELD_OUT_WIDE) * held_out_s, FAST_SINES)

        return self._recorded(path, rng, fly)

    def record_pulled(self, path: Path, rng: np.random.Generator, operator: np.random.Generator | None) -> Notes:
        """Write the recording of the plan without weights, and then of slow motion while an operator pulls.

        The CSV table has the columns of the force sensor. Without the operator's random numbers no one pulls, and
        there is no sensor.
        """
        rig, mount = self.rig, self.description.calibration.mount
        sensor = None if operator is None else rig.mount_force_sensor(mount)

        def fly(part: _Part) -> None:
            part.plan(is_weighted=False)
            part.pulled(operator)

        return self._recorded(path, rng, fly, sensor)

    def record_motion(self, path: Path, motion: Excitation) -> Notes:
        """Write the recording of one period of a motion, with notes and a CSV table."""
        dt = self.rig.period_s

        def fly(part: _Part) -> None:
            part.run.follow(empty_motion(motion, part.run.pilot.q.copy(), dt), "further")

        return self._recorded(path, np.random.default_rng(0), fly)

    def _recorded(
        self,
        path: Path,
        rng: np.random.Generator,
        fly: Callable[["_Part"], None],
        force_sensor: ForceSensor | None = None,
    ) -> Notes:
        notes = Notes()
        settings = {
            "rig": self.description.name,
            "title": self.description.settings.title,
            "side": "right",
            "command": "hidden_machines.py record",
            "torque_source": "current",
        }
        nominal = self.description.nominal_gain
        with RecordingWriter(path, self.rig.joints, settings) as recording:
            envelope = Envelope(limits(self.description), self.rig.period_s)
            pilot = Pilot(self.rig, ActuatorGain(nominal, GAIN_SD * nominal), envelope, recording)
            bench = NotedBench(self.rig, notes, recording, self.description.calibration.weights_kg[-1])
            part = _Part(EmptyRun(self.description, self.tree, pilot, bench), notes, rng, self.rig)
            fly(part)
            part.go_home()
            recording.write("/result", self.rig.t, {"rig": self.description.name, "simulated_s": round(self.rig.t, 3)})
        path.with_suffix(".json").write_text(json.dumps(self._public(notes), indent=1), encoding="utf-8")
        write_table(path, {} if force_sensor is None else force_sensor.samples)
        self.mean_gain[path.stem] = self.rig.take_mean_gain()
        return notes

    def _public(self, notes: Notes) -> dict[str, object]:
        """Return what a laboratory knows of its machine and its recording."""
        return {
            "rig": self.description.name,
            "joints": list(self.rig.joints),
            "period_s": self.rig.period_s,
            "nominal_gain_Nm_per_A": self.description.nominal_gain.tolist(),
            "notes": notes.entries,
        }


@dataclass
class _Part:
    """Motions of one recording."""

    run: EmptyRun
    notes: Notes
    rng: np.random.Generator
    rig: HiddenRig

    def plan(self, is_weighted: bool = True) -> None:
        """Push, sweep, hang a weight, move along sums of sines, step the torque, and release."""
        run, plans = self.run, self.run.description.calibration.sweeps
        self._begin("breakaway")
        BreakawayTester(run).nudge(pushes=1)
        for one in plans:
            self._begin(f"sweep_{one.joint}")
            run.follow(to_and_fro(run, one, SLOW, FAST, CREEP), one.joint)
        for one in plans if is_weighted else ():
            self._begin(f"weight_{one.joint}")
            mount = one.mount or run.description.calibration.mount
            run.load(mount, len(run.description.calibration.weights_kg) - 1)
            run.follow(to_and_fro(run, one, SLOW, way=0.5), one.joint)
            run.load(mount, None)
        self.sines("sines", 50.0, WIDE)
        self.sines("fast_sines", 20.0, FAST_SINES)
        self.steps(16.0)
        self.releases()

    def sines(self, phase: str, seconds: float, kind: Sines) -> None:
        """Move along sums of sines with frequencies, phases and amplitudes of their own in every joint."""
        path = self._to_sines(seconds, kind)
        self._begin(phase)
        self.run.follow(path, phase)

    def pulled(self, operator: np.random.Generator | None) -> None:
        """Move slowly through the workspace while an operator pulls; without random numbers no one pulls."""
        path = self._to_sines(PULLED_S, PULLED)
        self._begin("unpulled" if operator is None else "pulled")
        if operator is not None:
            self.rig.operator = Operator(operator, self.rig.t, len(path) * self.rig.period_s)
        self.run.follow(path, "pulled")
        self.rig.operator = None

    def steps(self, seconds: float) -> None:
        """Hold a raised posture, and add steps of torque of random sizes at random times to every joint."""
        run, dt = self.run, self.run.pilot.rig.period_s
        raised = np.deg2rad([45.0, 20.0, 0.0, 70.0])
        self._begin("steps")
        run.follow(go_to(run.pilot.q, raised, TRAVEL, dt), "steps")
        beside = Beside(run.controller, np.zeros(len(raised)))
        left = np.zeros(len(raised))

        def renew(_moment: TickSample) -> None:
            left[:] -= dt
            for joint in np.flatnonzero(left <= 0.0):
                left[joint] = self.rng.uniform(*STEP_S)
                beside.added[joint] = self.rng.uniform(-STEP_NM, STEP_NM)

        run.pilot.run(beside, hold(raised, seconds, dt), "steps", renew)

    def releases(self) -> None:
        """Raise the machine, release it without torque, and let friction stop it."""
        run, dt = self.run, self.run.pilot.rig.period_s
        self._begin("releases")
        for number in range(RELEASES):
            raised = np.deg2rad(RELEASED_DEG) * (1.0 + 0.5 * number)
            run.follow(joined([go_to(run.pilot.q, raised, TRAVEL, dt), hold(raised, 0.5, dt)]), "releases")
            beside = Beside(run.controller, np.zeros(len(raised)))
            beside.share = 0.0
            self.notes.add(run.pilot.rig.t, released=number)
            run.pilot.run(beside, hold(raised, 1.5, dt), "released")
            self.notes.add(run.pilot.rig.t, caught=number)
            run.pilot.run(run.controller, hold(run.pilot.q.copy(), 0.5, dt), "caught")

    def go_home(self) -> None:
        """Move to where the machine hangs."""
        run, dt = self.run, self.run.pilot.rig.period_s
        self._begin("home")
        run.follow(go_to(run.pilot.q, starting_posture(run.tree), TRAVEL, dt), "home")

    def _to_sines(self, seconds: float, kind: Sines) -> Trajectory:
        """Draw sums of sines, with the way to their start before them."""
        run, dt = self.run, self.run.pilot.rig.period_s
        path = sum_of_sines(run.description, self.rng, kind, seconds, dt)
        return joined([go_to(run.pilot.q, path.q[0], TRAVEL, dt), path])

    def _begin(self, phase: str) -> None:
        self.run.pilot.begin(phase)
        self.notes.add(self.run.pilot.rig.t, phase=phase)


def sum_of_sines(
    description: RigDescription, rng: np.random.Generator, kind: Sines, seconds: float, dt: float
) -> Trajectory:
    """Return a sum of sines within the task's workspace, whose speed and acceleration begin and end at zero."""
    box = description.settings.task_workspace
    lower, upper = np.deg2rad(box.lower_deg), np.deg2rad(box.upper_deg)
    t, n, waves = np.arange(1, round(seconds / dt) + 1) * dt, len(lower), 7
    omega = 2.0 * np.pi * np.exp(rng.uniform(np.log(kind.lowest_Hz), np.log(kind.highest_Hz), (waves, n)))
    size, phase = rng.uniform(0.3, 1.0, (waves, n)) / omega**0.7, rng.uniform(0.0, 2.0 * np.pi, (waves, n))
    shape = np.sum(size * np.sin(omega * t[:, None, None] + phase), axis=1)
    v, a = np.gradient(shape, dt, axis=0), np.gradient(np.gradient(shape, dt, axis=0), dt, axis=0)
    room = 0.5 * (upper - lower) / np.abs(shape - shape.mean(axis=0)).max(axis=0)
    scale = np.minimum(room, np.minimum(kind.v_max / np.abs(v).max(axis=0), kind.a_max / np.abs(a).max(axis=0)))
    fade = np.clip(np.minimum(t, t[-1] - t) / 2.0, 0.0, 1.0)[:, None]
    fade = fade**3 * (10.0 - 15.0 * fade + 6.0 * fade**2)
    q = 0.5 * (lower + upper) + fade * scale * (shape - shape.mean(axis=0))
    v = np.gradient(q, dt, axis=0)
    return Trajectory(q, v, np.gradient(v, dt, axis=0), dt)


def write_table(path: Path, wrenches: Mapping[int, Wrench]) -> None:
    """Write a recording as CSV with named columns, as `exograv arm identify-log` reads them.

    Args:
        path: Recording.
        wrenches: Measured force [N] and moment [N·m] by the number of the tick; empty without a force sensor.
    """
    recording = read_recording(path)
    names, ticks = recording.joints, recording.ticks
    columns = {"t": ticks["t"][:, None]}
    v = np.gradient(ticks["q_measured"], ticks["t"], axis=0)
    for stem, values in (
        ("q", ticks["q_measured"]),
        ("v", v),
        ("i", ticks["current"]),
        ("tau", ticks["tau_measured"]),
        ("tau_commanded", ticks["tau_commanded"]),
    ):
        columns |= {f"{stem}_{name}": values[:, [joint]] for joint, name in enumerate(names)}
    if wrenches:
        measured = np.array([wrenches[number] for number in ticks["sequence"].tolist()])
        columns |= {name: measured[:, [place]] for place, name in enumerate(FORCE_COLUMNS)}
    with path.with_suffix(".csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows([f"{value:.9g}" for value in row] for row in np.hstack(list(columns.values())))
