"""Replay of a live run: the guard gets its recorded inputs, and control answers the measurements that it answered."""

from array import array
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from exograv.dynamics.parameters import Parameters
from exograv.errors import ConfigError
from exograv.loop.person_limits import person_limits
from exograv.loop.pilot import Progress
from exograv.loop.replay.columns import ReplayedDecisions, ReplayedPiece
from exograv.loop.replay.guard_replay import SETTLED_S, GuardReplay
from exograv.loop.replay.recorded_run import RecordedRun, readable
from exograv.loop.replay.what_if import ReplayOverrides
from exograv.loop.replay_log import read_machine, read_person
from exograv.model.assembly import Assembly
from exograv.motion import Trajectory
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.rehabilitation.guided.mirror_plan import MirrorPlan
from exograv.procedures.verification.postures import Verification
from exograv.recording.fields import Message
from exograv.runtime.control_loop.exchange import (
    EVENT_SHIFT,
    TOLD_LEVEL,
    TOLD_PERSON,
    answer_dtype,
    finding_dtype,
    state_dtype,
)
from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest, SafeState
from exograv.safety.modes import Mode
from exograv.signals import JointState

from .live_control import MODES, LiveControl
from .live_identification import LiveIdentification, lesson_passes
from .procedure_orders import Order, OrderedMotion, TaughtRows, read_order

REACH = 32
"""Number of past measurements for which `seen` of a tick records if control has answered."""


class LiveReplay:
    """Replay of the ticks of one recording."""

    def __init__(self, recorded: RecordedRun, instead: ReplayOverrides):
        """Build guard and control in their initial state.

        Raises:
            RecordingError: The initial state in the recording cannot be read.
            ConfigError: A replacement in `instead` cannot be used.
        """
        path, joints = recorded.recording.path, len(recorded.recording.joints)
        self._columns, self._names = next(recorded.pieces()), recorded.phase_names
        self._again = ReplayedDecisions.of(0, joints)
        self._state, self._row = np.zeros(1, state_dtype(joints)), np.zeros((), answer_dtype(joints))
        self._waiting: deque[np.void] = deque(maxlen=REACH)
        self._settles_at, self._k, self._safe_state_before = -np.inf, 0, SafeState.NONE
        self.closure_slope = 0.0
        """Residual slope of the cuff energy in the answer to this tick [N·m]; 0 without an answer."""
        live, level = recorded.live or {}, instead.gravity_level
        with readable(path):
            machine = instead.machine(read_machine(live["machine"]), recorded.assembly)
            x = instead.parameters(np.array(live["x"]), machine, recorded.assembly)
            level = recorded.recording.settings["gravity_level"] if level is None else level
            limits = read_person(live["person"])
            if instead.arm_is_other:
                limits = person_limits(recorded.assembly, machine, x)
            actuators = read_machine(live["machine"]).actuators
            acts = _acts(recorded.control)
            asked = [(m["t"], m["gravity_level"], m.get("ramp_s", 0.0)) for m in acts["level"]]
            levels = asked if instead.gravity_level is None else []
            period_s, is_other = live["period_s"], instead.is_anything
            taken = sum(
                int(np.count_nonzero(ticks["acts"] & TOLD_LEVEL)) for ticks in recorded.recording.pieces(("acts",))
            )
            self._guarding = GuardReplay(
                recorded.description,
                actuators,
                period_s,
                limits,
                level,
                levels,
                takes_each=len(levels) == taken,
                is_other_run=is_other,
            )
            self._guarding.know(recorded.guard_states)
            if not 0.0 <= level <= 1.0:
                raise ConfigError(f"The gravity level of {path} is {level}; allowed: 0 to 1.")
            self._recorded, self._instead, self._machine = recorded, instead, machine
            self._acts = acts
            self._finding = np.zeros(1, finding_dtype(len(x)))[0]
            self._found, self._read, self._persons, lesson = 0, 0, 0, None
            self._orders, self._given = 0, 0
            if seconds := live.get("identify_s"):
                passes = lesson_passes(recorded.assembly, seconds, live["period_s"], _verification(live))
                lesson = LiveIdentification(
                    recorded.assembly, seconds, live["period_s"], lambda _row: None, self._newest, passes
                )
                self._guarding.feel(level, is_driven=True)
            prepared = ControllerKnowledge(recorded.assembly, machine, x, 0.0)
            is_steered = bool(live.get("is_steered"))
            self._control = LiveControl(
                prepared, level, lesson=lesson, period_s=period_s, is_steered=is_steered,
                publishes_later=bool(live.get("publishes_later")),
                orders=OrderedMotion(
                    recorded.description, period_s, self._next_order, taught=_taught(live, period_s),
                    mirrored=_mirrored(live, recorded.assembly),
                ),
            )  # fmt: skip
            self._prepare()
            self._guarding.forget(actuators.torque(self._columns["current"][0]))

    def fly(self, progress: Progress) -> Iterator[ReplayedPiece]:
        """Replay all ticks and yield the decisions of guard and control, in pieces."""
        total = self._recorded.recording.tick_count
        for columns in self._recorded.pieces():
            progress("Replaying", columns.first / total)
            self._columns = columns
            self._again.begin(len(columns))
            for k in range(len(columns)):
                if columns.lost[k]:
                    self._lose(k)
                self._tick(k)
            yield columns, self._again
        progress("Replaying", 1.0)

    def _tick(self, k: int) -> None:
        columns, again, guarding = self._columns, self._again, self._guarding
        if columns.acts[k] & TOLD_PERSON:
            self._wear()
        while self._persons < guarding.persons_by(columns.now[k]):  # their ticks are lost
            self._wear()
        if event := columns.acts[k] >> EVENT_SHIFT:
            self._state["asked"], self._state["event"] = self._state["asked"] + 1, event - 1
        self._k, self._safe_state_before = k, guarding.safe_state
        again.knows_control[k] = columns.t[k] >= self._settles_at
        guarding.take(k, columns, self, again)

    def answer(self, believed: JointState | None, now: float) -> ControlRequest | None:
        """Return the answer of control, if it came in time in the run."""
        k, self.closure_slope = self._k, 0.0
        if believed is None:
            return None
        self._waiting.append(self._told(believed, now, int(self._safe_state_before)))
        if not self._columns.seen[k]:
            return None
        self._catch_up(k)
        tau = self._row["tau"].copy()
        self._again.tau_desired[k], self.closure_slope = tau, float(self._row["slope"])
        return ControlRequest(believed.sequence, now + COMMAND_LIFE_S, tau)

    def _prepare(self) -> None:
        """Prepare control as in the run; runs of earlier versions prepared nothing."""
        for message in self._acts["prepare"]:
            state = np.zeros(1, state_dtype(len(message["q"])))[0]
            with readable(self._recorded.recording.path):
                state["q"] = message["q"]
            self._control.prepare(state)

    def _told(self, believed: JointState, now: float, safe_state: int) -> np.void:
        state = self._state.copy()
        state["sequence"], state["now"], state["safe_state"] = believed.sequence, now, safe_state
        state["q"], state["current"], state["persons"] = believed.q, believed.current, self._persons
        state["gravity_level"] = self._guarding.gravity_level
        return state[0]

    def _wear(self) -> None:
        """Give the guard the limits of the person whose arm was learned."""
        with readable(self._recorded.recording.path):
            message = self._acts["wear"][self._persons]
            limits = read_person(message["person"])
            if self._instead.arm_is_other:
                x = self._parameters(self._acts["publish"][-1])
                limits = person_limits(self._recorded.assembly, self._machine, x)
            self._guarding.wear(limits, message["gravity_level"], message["is_driven"])
        self._persons += 1

    def _newest(self) -> tuple[int, np.void] | None:
        """Return the number and the newest of the worker's findings that control knew."""
        if not self._found:
            return None
        if self._found != self._read:  # control asks in every tick
            with readable(self._recorded.recording.path):
                message = self._acts["publish"][self._found - 1]
                self._finding["now"], self._finding["x"] = message["t"], self._parameters(message)
            self._read = self._found
        return self._found, self._finding

    def _next_order(self) -> Order | None:
        """Return the next order of a procedure that control had taken."""
        if self._given >= self._orders:
            return None
        with readable(self._recorded.recording.path):
            order = read_order(self._acts["order"][self._given])
            if order.x is not None:
                other = self._instead.parameters(np.array(order.x), self._machine, self._recorded.assembly)
                order = replace(order, x=tuple(other.tolist()))
        self._given += 1
        return order

    def _parameters(self, message: Message) -> Parameters:
        return self._instead.parameters(np.array(message["x"]), self._machine, self._recorded.assembly)

    def _catch_up(self, k: int) -> None:
        """Give control each measurement that it answered in the run since its last answer, up to the present one."""
        seen, newest, inputs = self._columns.seen[k], self._columns.sequence[k], self._columns.control[k]
        # A procedure gives its first order after the last finding of the worker.
        self._found = min(inputs, len(self._acts["publish"]))
        self._orders = inputs - self._found
        for state in self._waiting:
            back = newest - int(state["sequence"])
            if back < REACH and seen >> back & 1:
                self._control.answer(state, self._row)
                self._control.afterwards()
        if len(self._waiting) == REACH:
            # Control may have answered older measurements that `seen` does not record, too late for the guard.
            self._settles_at = self._columns.t[k] + SETTLED_S
        self._waiting.clear()

    def _lose(self, k: int) -> None:
        columns = self._columns
        self._again.gaps.append((columns.t[k], columns.lost[k]))
        self._guarding.lose(k, columns)
        self._waiting.clear()
        self._settles_at = columns.t[k] + SETTLED_S
        name, share = self._names[columns.phase[k]], columns.mode[k][2]
        mode = next((mode for mode in MODES if mode.name.lower() == name), Mode.FLOATING)
        self._control.forget(mode, share if np.isfinite(share) else float(mode in (Mode.FLOATING, Mode.MOVING)))


class _Acts:
    """Messages to control of one kind, by their places: of a long recording they stay in the file."""

    def __init__(self, messages: Sequence[Message], places: Sequence[int]):
        self._messages, self._places = messages, places

    def __iter__(self) -> Iterator[Message]:
        return (self._messages[place] for place in self._places)

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, number: int) -> Message:
        return self._messages[self._places[number]]


def _acts(messages: Sequence[Message]) -> Mapping[str, _Acts]:
    """Return the messages to control by their act."""
    places: dict[str, array[int]] = {act: array("L") for act in ("level", "publish", "wear", "prepare", "order")}
    for k, message in enumerate(messages):
        if message["act"] in places:
            places[message["act"]].append(k)
    return {act: _Acts(messages, found) for act, found in places.items()}


def _taught(live: Mapping[str, Any], period_s: float) -> Trajectory | None:
    said = live.get("taught")
    return None if said is None else TaughtRows(said["q_rad"], said["period_s"]).trajectory(period_s)


def _mirrored(live: Mapping[str, Any], assembly: Assembly) -> MirrorPlan | None:
    leading = live.get("leading")
    return None if leading is None else MirrorPlan.of(assembly, leading)


def _verification(live: Mapping[str, Any]) -> Verification | None:
    said = live.get("verification")
    return None if said is None else Verification(np.array(said["postures"]), said["seed"])
