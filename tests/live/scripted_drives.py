"""Loops in Python and in C on the same inputs, in a scripted world each."""

import contextlib
import ctypes
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path

import numpy as np
import pytest

from exograv.live.guard_job import GuardedRig, GuardJob, answer_by_ns
from exograv.live.guard_process import GuardLoop
from exograv.live.native import library
from exograv.live.native_guard import NativeGuard
from exograv.model.description import load_rig
from exograv.recording.encoding import tick_dtype
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.native.record import NOTHING, Now, Receive, Send, Sleep
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.udp.host import UdpRig
from exograv.runtime.control_loop.exchange import Channels, answer_dtype, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.recorder.recorder_process import (
    EVENT,
    RING_EVENTS,
    RING_GUARDS,
    RING_TICKS,
    Inlet,
    guard_dtype,
)
from exograv.safety.envelope import Envelope
from exograv.safety.guard import COMMAND_LIFE_S, Guard
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native.library import Library
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable

from .scripted_world import (
    DAWDLE,
    DEAD,
    HUGE,
    JOINTS,
    NAN,
    OPEN_LOOPS,
    OTHER_MODE,
    SILENT,
    WRONG_MODE,
    WRONG_NUMBER,
    Script,
    World,
)

DESCENT_S = 0.05
EXAMPLES = Path(__file__).parents[2] / "examples" / "drives"
MODES = ("off", "exo_only", "floating")
GAIN = np.array([7.0, 6.5, 5.0, 4.0])


@dataclass
class Side:
    """Loop in its world, and the memory that it shares with control and recorder."""

    world: World
    rig: UdpRig | CanopenRig
    guard: Guard
    job: GuardJob
    made: GuardedRig
    states: Mailbox
    answers: Mailbox
    ticks: Ring
    events: Ring
    guards: Ring
    lines: tuple[object, object]

    def __post_init__(self):
        self._row, self._seen, self._due = np.zeros((), answer_dtype(JOINTS)), 0, 0
        self._before = int(self.states.count)
        self.world.control_looks = self.look

    def look(self) -> None:
        """Let control answer a new state, as the script says."""
        world, got = self.world, self.states.read()
        if got is None:
            return
        if got[0] != self._seen:
            self._seen = got[0]
            slow = world.script.control[world.tick] == DAWDLE
            self._due = world.now + (9 * self.job.period_ns // 10 if slow else 0)
            self._state, self._is_answered = got[1], False
        if self._is_answered or world.now < self._due:
            return
        self._is_answered, what, row, k = True, world.script.control[world.tick], self._row, world.tick
        if what == SILENT:
            return
        row["sequence"] = self._state["sequence"] - (what == WRONG_NUMBER)
        row["valid_until"] = self._state["now"] + (-1.0 if what == DEAD else COMMAND_LIFE_S)
        row["mode"] = 99 if what == WRONG_MODE else min(k // 40, 2) if what != OTHER_MODE else 1
        row["slope"] = 0.5 if what == OPEN_LOOPS else 1e-9
        row["tau"] = world.script.tau[k]
        row["tau"][2] = {NAN: np.nan, HUGE: 1e9}.get(what, row["tau"][2])
        row["v"], row["q_reference"], row["tau_feedforward"] = 0.1 * k, np.nan, row["tau"] * 0.9
        row["findings"], row["seen"], row["gravity_level"] = k // 10, (1 << 40) + k, self._state["gravity_level"]
        row["drive"], row["arm_share"] = 0.0, 1.0
        self.answers.write(row)


def limits_of_person(level: float = 30.0) -> PersonLimits:
    """Return limits of a person whose arm weighs something."""
    exo, arm = np.zeros((JOINTS, 9)), np.zeros((JOINTS, 9))
    exo[:, 1], arm[:, 2] = 1.0, 2.0
    wide = np.full(JOINTS, level)
    # A chain of two joints has nine products.
    chains = tuple(LimbTable((a, b), 2, exo[[a, b]], arm[[a, b]]) for a, b in ((0, 1), (2, 3)))
    still = np.full(JOINTS, 0.5)
    return PersonLimits(PlausibleTable(chains, still, still, still), wide, np.full(JOINTS, -3.0), np.full(JOINTS, 3.0))


def _guard(native: Library | None, period_s: float) -> Guard:
    limits = Limits(np.full(JOINTS, 30.0), np.full(JOINTS, 10.0), descent_s=DESCENT_S)
    envelope = Envelope(limits, period_s, native)
    envelope.person = GuardedPerson(limits_of_person(), 0.4)
    return Guard.of_machine(envelope, period_s, GAIN.tolist())


@contextlib.contextmanager
def side(script: Script, native: Library | None, make: type[World], ticks: int = 10_000) -> Iterator[Side]:
    """Yield one machine whose drives are switched on, its guard, and shared memory."""
    world = make(script)
    drives = load_drives(EXAMPLES / world.example, load_rig("recupera_like"))
    with contextlib.ExitStack() as stack:
        world.use(stack.enter_context(pytest.MonkeyPatch.context()))
        rig = world.machine(drives)
        guard = _guard(native, drives.period_s)
        made = GuardedRig(rig, guard, GAIN)
        memory = [
            stack.enter_context(contextlib.closing(one))
            for one in (
                Mailbox(state_dtype(JOINTS)), Mailbox(answer_dtype(JOINTS)), Ring(tick_dtype(JOINTS), RING_TICKS),
                Ring(EVENT, RING_EVENTS), Ring(guard_dtype(JOINTS), RING_GUARDS),
            )
        ]  # fmt: skip
        states, answers, rows, events, guards = memory
        channels = Channels(JOINTS, states.name, answers.name, Inlet(JOINTS, rows.name, events.name, guards.name))
        job = GuardJob(lambda: made, channels, ticks, MODES, period_ns=round(1e9 * drives.period_s))
        yield Side(world, rig, guard, job, made, states, answers, rows, events, guards, Pipe())  # type: ignore[arg-type]


class PythonSide:
    """The loop in Python."""

    def __init__(self, one: Side, patch: pytest.MonkeyPatch):
        self.side, self._patch = one, patch
        self.guarding = GuardLoop(one.job, one.lines[0], one.made)  # type: ignore[arg-type]

    def order(self, word: object) -> None:
        """Give a message of the parent, after the tick."""
        self.guarding.hearing.hear(word, self.side.rig.t)

    def run(self, period: int) -> bool:
        """Run one tick."""
        self.side.world.use(self._patch)
        return self.guarding.tick(period)

    def close(self) -> None:
        self.guarding.close()


class NativeSide:
    """The loop in C."""

    def __init__(self, one: Side):
        self.side, world = one, one.world
        assert library.LIBRARY is not None
        self.library = library.LIBRARY
        parent = one.lines[0]
        self.guarding = NativeGuard(one.job, parent, one.made, world.bus, self.library)  # type: ignore[arg-type]
        self.guarding.loop.answer_by_ns = answer_by_ns(one.job.period_ns)  # as long as the loop in Python waits

        def received(_drives: int, into: int, _size: int, until_ns: int) -> int:
            data = world.received_by_c(until_ns)
            if data is None:
                return NOTHING
            ctypes.memmove(into, data, len(data))
            return len(data)

        self._hooks = (
            Now(lambda _drives: world.now),
            Sleep(lambda _drives, until_ns: world.sleep_until(until_ns)),
            Send(lambda _drives, data, size: world.sent_by_c(ctypes.string_at(data, size))),
            Receive(received),
        )
        for name, hook in zip(("now_hook", "sleep_hook", "send_hook", "receive_hook"), self._hooks, strict=True):
            setattr(self.guarding.drives, name, ctypes.cast(hook, ctypes.c_void_p).value)
        self.guarding.hand_over()

    def order(self, word: object) -> None:
        """Give a message of the parent; the loop takes it at the end of the next tick."""
        self.guarding.order(word)
        while self.guarding._waiting:
            assert self.library.loop_order(self.guarding.loop, self.guarding._waiting.popleft())

    def run(self, period: int) -> bool:
        """Run one tick."""
        return bool(self.library.loop_tick(self.guarding.loop, period))

    def take_back(self) -> None:
        """Give the machine back to its driver in Python."""
        self.side.world.bus.take_back(self.side.rig, self.guarding.drives)

    def close(self) -> None:
        self.guarding.hear()
        self.guarding.close()
