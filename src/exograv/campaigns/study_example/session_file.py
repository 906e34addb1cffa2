"""Session of the example: the protocol runs in the real task room, and the recording has the usual form."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exograv.laboratory.participant.aircraft_feed import AircraftFeed
from exograv.laboratory.participant.screen_session import ScreenSession
from exograv.laboratory.participant.touch_panel import TouchPanel
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.loop.run_settings import RunSettings
from exograv.motion import smooth_share
from exograv.recording import RecordingWriter
from exograv.recording.encoding import empty_ticks
from exograv.results import json_value
from exograv.task.events import Start
from exograv.task.plan import TaskPlan
from exograv.task.record_sinks import aircraft_sink, recording_sink
from exograv.task.records import Record, WindowClosed, WindowOpened
from exograv.task.run import TaskRun

from .arm_tables import NODES, ArmTables
from .pointer import Pointer

RATE_HZ = 60.0
"""Rate of recorded ticks [Hz], enough for the positions of a reach; a real machine has 1000."""

SKELETON_HZ = 20.0
STEP_S = 0.1
"""Time step [s], the aircraft's own."""

REACTION_S = 1.4
"""Time from a window's opening to the first movement [s]: 0.35 s, and 1 s to tense the muscles; assumed, as in
`experiment/train/`."""

REACH_S, STAY_S = 0.9, 0.2
"""Time to reach the screen or to return [s], and time on the screen [s]."""

ENCODER_RAD = 1e-4
"""Resolution of an encoder [rad]; assumed."""

TORQUE_SD = 0.1
"""Noise of torque from the motors' current, SD [N·m]; assumed."""


@dataclass(frozen=True)
class ScreenReach:
    """Movement to the screen and back."""

    contact: float
    """Time of the touch [s]."""

    change: np.ndarray
    """Posture change at the screen [rad]."""


class ExampleSession:
    """Session of one person before a screen, for one protocol."""

    def __init__(self, plan: TaskPlan, room: SimulatedRoom, tables: ArmTables, pointer: Pointer, seed: int):
        """Begin before the first step.

        Args:
            plan: Protocol, machine and screen.
            room: Room of the screen.
            tables: Tables of the person's arm.
            pointer: The person.
            seed: Seed of the flight and of all noise of this session.
        """
        self._plan, self._tables, self._pointer, self._seed = plan, tables, pointer, seed
        self._random = np.random.default_rng([seed, 42])
        self.run, self.t, self._step = TaskRun(plan), 0.0, 0
        self._reaches = list[ScreenReach]()
        self._panel = TouchPanel(room, plan.protocol.target, self._random, "simulated")

    def record(self, path: Path, joints: tuple[str, ...], settings: RunSettings) -> None:
        """Run the session and write its recording.

        Raises:
            RecordingError: The file cannot be written.
        """
        with RecordingWriter(path, joints, json_value(settings)) as recording:
            recording.phase(0.0, "task")
            self._go_through(recording)
            self._write_ticks(recording)
            figures = self.run.totals().figures()
            recording.write("/result", self.run.state.t, {
                "task": json_value(figures), "rig": settings.rig, "joints": list(joints), "seed": settings.seed,
                "simulated_s": round(self.run.state.t, 3),
            })  # fmt: skip

    @property
    def is_settling(self) -> bool:
        """Always false: there is no machine."""
        return False

    def fly(self, g: np.ndarray) -> None:
        """Ignore the acceleration of the aircraft, because the pointer takes its level from the windows."""

    def advance(self, session: ScreenSession) -> None:
        """Advance by one step. A rest between windows of a clocked protocol is skipped in one step."""
        self._step += 1
        if self._plan.is_clocked and self.run.state.window is None and self._panel.is_empty:
            timeline = self._plan.timeline
            phase = timeline.phase_at(self._step * STEP_S)
            self._step = max(self._step, int(min(phase.end_s, timeline.duration_s) / STEP_S) + 1)
        self.t = self._step * STEP_S
        session.tell(self.t)

    def why_over(self, run: TaskRun) -> str:
        """Reason to stop a run before the next step."""
        return "all windows are complete" if run.is_over((self._step + 1) * STEP_S) else ""

    def _go_through(self, recording: RecordingWriter) -> None:
        self.run.sinks = (recording_sink(recording), self._see_windows)
        aircraft = ()
        if not self._plan.is_clocked:
            aircraft = (AircraftFeed(self._plan.protocol, self, self._seed, aircraft_sink(recording)),)
        self.run.feed(Start(t=0.0))
        ScreenSession(self.run, (*aircraft, self._panel.reported)).fly(self)

    def _see_windows(self, _t: float, records: tuple[Record, ...]) -> None:
        """Draw the touches of a window that opens. Withdraw touches that come after a window has closed."""
        for record in records:
            if isinstance(record, WindowOpened):
                self._pointer.window(record.gravity_level if self._feels(record) else 1.0)
                self._plan_window(record.t)
            elif isinstance(record, WindowClosed):
                self._panel.withdraw(record.t)

    def _feels(self, record: WindowOpened) -> bool:
        """Return True if the window's level is real: made by the machine or by the aircraft."""
        return self._plan.exo == "active" or record.by != "clock"

    def _plan_window(self, opened: float) -> None:
        windows = self._plan.protocol.windows
        contact, closes = opened + REACTION_S + REACH_S, opened + windows.duration_s
        while contact + STAY_S < closes:
            change, landed_mm = self._pointer.reach()
            self._reaches.append(ScreenReach(contact, change))
            self._panel.draw(contact, landed_mm)
            interval = max(self._pointer.interval(), REACH_S + STAY_S + REACH_S)
            self._show_arrow(interval - windows.interval_s)
            contact += interval

    def _show_arrow(self, late_s: float) -> None:
        pace = self._plan.protocol.pace
        if pace.shown and abs(late_s) > pace.tolerance_s:
            self._pointer.see_arrow(late_s)

    def _write_ticks(self, recording: RecordingWriter) -> None:
        """Write the arm's positions, and the torque that carried the arm."""
        t = np.arange(int(self.run.state.t * RATE_HZ)) / RATE_HZ
        share, change = _along(self._reaches, t, len(self._tables.rest))
        tables, n = self._tables, len(self._tables.rest)
        q = tables.rest + share[:, None] * (tables.touch - tables.rest + change)
        level = self._levels(t)
        weights = np.column_stack([np.interp(share * (NODES - 1), np.arange(NODES), w) for w in tables.weights.T])
        tau = (1.0 - level)[:, None] * weights
        rows = empty_ticks(len(t), n)
        rows["t"] = rows["now"] = t
        rows["phase"], rows["sequence"] = 1, np.arange(1, len(t) + 1)
        rows["gravity_level"], rows["arm_share"], rows["tick_us"] = level, 1.0, np.nan
        rows["q_measured"] = np.round(q / ENCODER_RAD) * ENCODER_RAD
        rows["q_reference"] = rows["current"] = np.nan
        rows["v"] = np.gradient(q, 1.0 / RATE_HZ, axis=0)
        rows["tau_feedforward"] = rows["tau_desired"] = rows["tau_commanded"] = tau
        is_on = self._plan.exo == "active"
        rows["tau_measured"] = tau + is_on * TORQUE_SD * self._random.standard_normal(tau.shape)
        recording.ticks(rows)
        self._write_skeletons(recording, t, share, change)

    def _levels(self, t: np.ndarray) -> np.ndarray:
        """Gravity level made by the machine [-]."""
        if self._plan.exo != "active":
            return np.ones(len(t))
        phases = self._plan.timeline.phases
        times = np.array([[phase.start_s, phase.end_s] for phase in phases]).ravel()
        levels = np.array([[phase.level_from, phase.level_to] for phase in phases]).ravel()
        return np.interp(t, times, levels)

    def _write_skeletons(
        self, recording: RecordingWriter, t: np.ndarray, share: np.ndarray, change: np.ndarray
    ) -> None:
        tables = self._tables
        windows = [(w.opened, w.closed) for w in self.run.state.windows if w.closed is not None]
        drawn = np.concatenate([np.arange(*np.searchsorted(t, window)) for window in windows] or [np.zeros(0, int)])
        for k in drawn[:: round(RATE_HZ / SKELETON_HZ)].tolist():
            exo, arm = (_between(points, float(share[k])) for points in (tables.exo, tables.arm))
            arm[-1] += share[k] * tables.tip_slope @ change[k]
            recording.write("/skeleton", float(t[k]), {"exo": exo.round(4).tolist(), "arm": arm.round(4).tolist()})


def _along(reaches: list[ScreenReach], t: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Share of the way to the screen at each time [-], and posture change of the present reach [rad]."""
    share, change = np.zeros(len(t)), np.zeros((len(t), n))
    for reach in reaches:
        begin, end = reach.contact - REACH_S, reach.contact + STAY_S + REACH_S
        part = slice(*np.searchsorted(t, [begin, end]))
        there = np.clip((t[part] - begin) / REACH_S, 0.0, 1.0)
        back = np.clip((t[part] - reach.contact - STAY_S) / REACH_S, 0.0, 1.0)
        share[part], change[part] = smooth_share(there) - smooth_share(back), reach.change
    return share, change


def _between(nodes: np.ndarray, share: float) -> np.ndarray:
    """Interpolate between evenly spaced nodes (node, …) at a share of the path."""
    place = share * (len(nodes) - 1)
    first = min(int(place), len(nodes) - 2)
    return nodes[first] + (place - first) * (nodes[first + 1] - nodes[first])
