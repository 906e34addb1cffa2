"""Fake desk without a machine: it has the modes of `safety`, swinging joints, and a list of all requests."""

import itertools
import math
import time
from collections.abc import Callable, Mapping
from typing import Any, get_args

from exograv.experiment.steered.requests import LATE_S, Act, Answer, Who
from exograv.experiment.steered.sentences import say
from exograv.experiment.steered.view_models import (
    ActKind,
    Lateness,
    LearnedParameter,
    Learning,
    MachineAlarm,
    PlotTrace,
    RecordingStatus,
    RestLearning,
    SessionSnapshot,
    SkeletonLines,
    WorkProgress,
)
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.scene import SceneDescription, describe_scene
from exograv.options import Side
from exograv.safety.modes import WORN, Event, Mode, ModeMachine
from exograv.safety.stops import StopReason

JOINTS = ("shoulder_abduction", "shoulder_rotation", "shoulder_flexion", "elbow_flexion")
LEVEL_PER_S = 0.2
RATE_Hz = 50.0
FASTER = 20.0
"""Speed of ramps and self-test, so that tests are short."""


class FakeDesk:
    """Fake desk, thread-safe as far as tests need it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, is_known: bool = True):
        self.now = clock
        self.began = clock()
        self.machine = ModeMachine()
        self.is_known = is_known
        self.is_twin = True
        self.age_s = 0.0
        self.work: WorkProgress | None = None
        self.rests: RestLearning | None = None
        self.asked = list[tuple[Act, Who]]()
        """Events that reached the desk."""

        self.taken = list[Act]()
        self.written = list[tuple[str, float, dict[str, Any]]]()
        self.kept = list[float | None]()
        self.alarms = list[MachineAlarm]()
        self.answers = dict[str, Answer]()
        self.version = 1
        self.level_asked = self.level = 1.0
        self.latch: str | None = None
        self.participant = "T01" if is_known else None
        self.side: Side = "right"
        self._learning_since: float | None = None
        self._scene: SceneDescription | None = None
        self._stepped = self.began
        self._numbers = itertools.count(1)

    def shown(self) -> SessionSnapshot:
        self._step()
        t, mode = self.now(), self.machine.mode
        q = self._q(t)
        return SessionSnapshot(
            version=self.version,
            t=t,
            rig="recupera_like",
            title="Recupera-like, right arm",
            side=self.side,
            sides=("right", "left"),
            is_twin=self.is_twin,
            age_s=self.age_s,
            work=self.work,
            rests=self.rests,
            participant=self.participant,
            participants=("T01", "T02"),
            is_known=self.is_known,
            mode=mode.name.lower(),  # pyright: ignore[reportArgumentType]
            mode_text=mode.sentence,
            safe_state="descent" if mode is Mode.SAFE else "none",
            latch=self.latch,
            take_within_s=30.0 if mode is Mode.EXO_ONLY else None,
            possible=tuple(kind for kind in get_args(ActKind) if self._why_not(kind) is None),
            lease_left_s=1.2 if self.kept else None,
            joints=JOINTS,
            q_rad=q,
            v_rad_s=tuple(0.1 * value for value in q),
            tau_desired_Nm=tuple(4.0 * value for value in q),
            tau_commanded_Nm=tuple(3.9 * value for value in q),
            tau_limit_Nm=(40.0, 30.0, 40.0, 20.0),
            gravity_level_asked=self.level_asked,
            gravity_level=self.level,
            arm_share=self.machine.arm_share,
            lateness=None if mode is Mode.OFF else Lateness(p50_us=38.0, p99_us=131.0, max_us=412.0),
            recorded=None
            if mode is Mode.OFF
            else RecordingStatus(path="out/live.mcap", samples=int(1e3 * (t - self.began)), lost=0, is_ok=True, why=""),
            learning=self._learning(t),
            alarms=tuple(alarm for alarm in self.alarms if alarm.acknowledged_by is None or not alarm.is_over),
        )

    def trace(self, since: int) -> PlotTrace:
        newest = int((self.now() - self.began) * RATE_Hz)
        first = max(since, newest - 500, 0)
        times = [self.began + number / RATE_Hz for number in range(first, newest)]
        q = tuple(self._q(t) for t in times)
        desired = tuple(tuple(4.0 * value for value in row) for row in q)
        commanded = tuple(tuple(3.8 * value for value in row) for row in q)
        measured = tuple(tuple(3.8 * v + 0.1 * math.sin(40 * t) for v in row) for t, row in zip(times, q, strict=True))
        return PlotTrace(
            first=first,
            next=max(newest, first),
            t=tuple(times),
            q_rad=q,
            tau_desired_Nm=desired,
            tau_commanded_Nm=commanded,
            tau_measured_Nm=measured,
        )

    def skeleton(self) -> SkeletonLines:
        return SkeletonLines(q_rad=self._q(self.now()), exo=(), arm=())

    def scene(self) -> SceneDescription:
        if self._scene is None or self._scene.side != self.side:
            self._scene = describe_scene(load_rig("recupera_like", self.side), Body(1.75, 75.0, "male"))
        return self._scene

    def act(self, act: Act, by: Who) -> Answer:
        if act.id in self.answers:
            return self.answers[act.id]
        self._step()
        self.asked.append((act, by))
        why = self._why_not(act.kind)
        if act.kind != "stop" and self.now() - act.made_at_s > LATE_S:
            why = "This came too late, and was not done."
        if why is None and getattr(act, "seen_version", self.version) != self.version:
            why = "Something has changed since. Look again."
        if why is None:
            self._do(act, by)
            self.taken.append(act)
        answer = Answer(id=act.id, taken=why is None, why=why or "")
        self.answers[act.id] = answer
        return answer

    def keep(self, window_left_s: float | None = None, heard_s: float | None = None) -> None:
        self.kept.append(window_left_s)

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        self.written.append((topic, t, dict(message)))

    def close(self) -> None:
        self.machine = ModeMachine()

    def alarm(self, text: str) -> None:
        """Raise an alarm of the machine."""
        self.alarms.append(
            MachineAlarm(number=next(self._numbers), text=text, priority="high", since_s=self.now(), is_over=True)
        )

    def _q(self, t: float) -> tuple[float, ...]:
        swing = 0.4 if self.machine.mode in WORN else 0.05
        since = t - self.began
        return tuple(at + swing * math.sin(since * (0.6 + 0.2 * i)) for i, at in enumerate((0.3, 0.0, 0.8, 1.2)))

    def _step(self) -> None:
        dt = self.now() - self._stepped
        self._stepped += dt
        before = self.machine.mode
        if before is Mode.SELF_TEST and dt > 0.0:
            self.machine.take(Event.PASSED)
        if before in (Mode.RAMP_IN, Mode.RAMP_OUT):
            self.machine.step(FASTER * dt, 0.0, 0.0)
        step = LEVEL_PER_S * FASTER * dt
        self.level += min(max(self.level_asked - self.level, -step), step)
        self.version += self.machine.mode is not before

    def _why_not(self, kind: str) -> str | None:
        mode = self.machine.mode
        needed = POSSIBLE[kind]
        if needed is not None and mode not in needed:
            return f"Not now. {mode.value}"
        return "The arm is not known." if kind == "take_arm" and not self.is_known else None

    def _do(self, act: Act, by: Who) -> None:
        events = {
            "make_ready": Event.TEST,
            "take_arm": Event.TAKE_ARM,
            "identify": Event.TAKE_ARM,
            "give_back": Event.GIVE_BACK,
            "stop": Event.FAULT,
            "reset": Event.RESET,
            "switch_off": Event.SWITCH_OFF,
        }
        if act.kind in events:
            self.machine.take(events[act.kind])
            self.version += 1
        if act.kind == "stop" and self.machine.mode is Mode.SAFE:
            self.latch = _why(act.why)
            self.alarm(self.latch)
        elif act.kind == "reset":
            self.latch = None
        elif act.kind == "don":
            self.participant, self.is_known = act.participant, act.participant is not None
            self.side = act.side or self.side
            self.version += 1
        elif act.kind == "set_level":
            self.level_asked = act.gravity_level
        elif act.kind == "identify":
            self._learning_since = self.now()
        elif act.kind == "acknowledge":
            seen = {"acknowledged_by": by}
            self.alarms = [a.model_copy(update=seen) if a.number == act.alarm else a for a in self.alarms]

    def _learning(self, t: float) -> Learning | None:
        if self._learning_since is None:
            return None
        share = min((t - self._learning_since) * FASTER / 60.0, 1.0)
        if share == 1.0:
            self.is_known = True
        shrink = math.exp(-3.0 * share)
        parameters = tuple(
            LearnedParameter(
                name=name,
                unit=unit,
                prior=prior,
                prior_half_width=0.4 * prior,
                mean=prior * (1.0 + 0.15 * share),
                half_width=0.4 * prior * shrink,
            )
            for name, unit, prior in (
                ("upper_arm.mass", "kg", 2.1),
                ("upper_arm.mx", "kg·m", 0.31),
                ("forearm.mass", "kg", 1.6),
                ("forearm.mx", "kg·m", 0.29),
            )
        )
        return Learning(
            share_done=share,
            parameters=parameters,
            left_over_Nm=(0.5 * shrink + 0.08, 0.3 * shrink + 0.04, 0.5 * shrink + 0.09, 0.2 * shrink + 0.03),
            left_over_prior_Nm=(0.7, 0.4, 0.8, 0.3),
            outcome="The arm is identified." if share == 1.0 else "The arm is being moved.",
            is_over=share == 1.0,
            farthest="elbow_flexion",
            help=say("learning.again" if share == 1.0 else "learning.relax", left_over="0.13", target="0.1"),
        )


FREE = frozenset({Mode.FLOATING, Mode.MOVING, Mode.WEIGHING})
POSSIBLE: dict[str, frozenset[Mode] | None] = {
    "don": frozenset({Mode.OFF}),
    "make_ready": frozenset({Mode.OFF}),
    "take_arm": frozenset({Mode.EXO_ONLY}),
    "identify": frozenset({Mode.EXO_ONLY}),
    "give_back": FREE | {Mode.RAMP_IN},
    "stop": None,
    "reset": frozenset({Mode.SAFE}),
    "switch_off": frozenset({Mode.SELF_TEST, Mode.EXO_ONLY}),
    "set_level": FREE | {Mode.EXO_ONLY, Mode.RAMP_IN},
    "learn_rest": frozenset({Mode.FLOATING}),
    "agree": frozenset({Mode.FLOATING}),
    "note": None,
    "acknowledge": None,
}


def _why(text: str) -> str:
    return next((reason.sentence for reason in StopReason if reason.value == text), text)
