"""Broadcast to the pages: state, plots, poses and alarms.

It also passes the protocol's gravity levels to the machine.
"""

import asyncio
import secrets
from collections.abc import Coroutine
from typing import Any

from exograv.experiment.steered.requests import SetLevel
from exograv.experiment.steered.view_models import MachineAlarm
from exograv.model.scene.arm_lines import arms_of_line
from exograv.safety.guard import GRAVITY_LEVEL_MAX
from exograv.task.levels import EARTH
from exograv.task.state import RunAlarm

from .alarms import ConsoleAlarm
from .hub import UNMANNED, Hub
from .keys import Role
from .lease import ALARM_AFTER_S
from .lease_loss import LeaseLoss, cause_of_silence
from .rest_announcement import RestAnnouncement
from .sentences import say, spoken
from .trial import ProtocolTrial

TICK_S = 0.015
"""Period of the broadcaster [s]."""

PLOTS_EVERY = 2
"""Ticks between messages with samples to plot: 33 a second."""

POSES_EVERY = 4
"""Ticks between messages with a pose. Each pose needs the solution of a closure."""

SHOWN_EVERY = 7
"""Ticks between messages with the state."""

PARTICIPANT_EVERY = 7
"""Ticks between pictures for the participant without a change. A changed picture is sent at once."""

LEVEL_STEP = 0.004
"""Smallest change of the gravity level that is sent to the machine [-]."""

MACHINE = frozenset({Role.OPERATOR, Role.VIEWER})
STEERED = MACHINE | {Role.THERAPIST}


class _Errand:
    """Background task of the broadcaster, one at a time. An exception in the task ends the broadcaster."""

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None

    def is_over(self) -> bool:
        if self._task is not None and self._task.done():
            self._task.result()
            return True
        return self._task is None

    def begin(self, errand: Coroutine[Any, Any, None]) -> None:
        self._task = asyncio.create_task(errand)


class Broadcaster:
    """Periodic sender of all messages that no page asks for, as long as the console runs."""

    def __init__(self, hub: Hub):
        """Take the state of the console. `go_round` starts to send."""
        self._hub, self._count, self._since = hub, 0, 0
        self._picture: dict[str, Any] = {}
        self._level: float | None = None
        self._announcement = RestAnnouncement()
        self._is_silent, self._stepped, self._late_s = False, hub.desk.now(), 0.0
        self._asking, self._looking, self._drawing = _Errand(), _Errand(), _Errand()

    async def go_round(self) -> None:
        """Run until cancelled. An exception ends the console."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            await self.step()
            # Late rounds are skipped, not repeated.
            due = max(due + TICK_S, loop.time() - TICK_S)
            await asyncio.sleep(due - loop.time())

    async def step(self) -> None:
        """Run one round: check the lease, advance the run, and send what is due to the pages."""
        hub, t = self._hub, self._hub.desk.now()
        self._count += 1
        self._watch_lease(t)
        if hub.trial is not None:
            self._run_trial(t, hub.trial)
        self._show_participant(t)
        if self._count % PLOTS_EVERY == 0 and self._drawing.is_over():
            self._drawing.begin(self._show_plots())
        if self._count % SHOWN_EVERY == 0:
            # The state is read for the next round: a desk that decides about an act must not delay the broadcast.
            if self._looking.is_over():
                self._looking.begin(hub.look())
            self._show_state(t)

    def _watch_lease(self, t: float) -> None:
        hub = self._hub
        holder, silent_s = hub.lease.holder, hub.lease.silent_s(t)
        was_silent, self._is_silent = self._is_silent, silent_s > ALARM_AFTER_S
        if self._is_silent and not was_silent and hub.shown.mode not in UNMANNED:
            hub.alarms.sound(say("alarm.silent", line=holder), t, "high")
        # The longest delay of this loop since the last heartbeat: a late server reads heartbeats late.
        self._late_s = max(self._late_s if silent_s > TICK_S else 0.0, t - self._stepped)
        self._stepped = t
        hub.lease.held_by(t)
        if (line := hub.lines.get(hub.lease.expired or 0)) is not None:
            cause = cause_of_silence(hub.lease.is_hidden, self._late_s)
            hub.lose(LeaseLoss(line.number, line.page, cause, silent_s), t)
        hub.lease.expired = None

    def _run_trial(self, t: float, trial: ProtocolTrial) -> None:
        hub = self._hub
        if hub.feed is not None and (why := hub.feed.step(t)):
            hub.alarms.sound(why, t, "high")
        if why := trial.tick(t, hub.shown):
            hub.alarms.sound(why, t, "high")
        for record in trial.news:
            for line in hub.lines.values():
                if line.role in MACHINE:
                    line.say("record", record=record.model_dump(mode="json"))
        trial.news.clear()
        self._ask_level(trial.level(t))

    def _show_participant(self, t: float) -> None:
        """Send the picture of the task, the reason why no page steers, and a motion in a rest. Nothing else is sent."""
        hub = self._hub
        picture = None if hub.trial is None else hub.trial.participant(t).model_dump(mode="json")
        notice = hub.loss.cause if hub.loss is not None and hub.lease.held_by(t) is None else None
        around = {"notice": notice, "rest": self._announcement.look(hub.shown, t)}
        steady = {key: value for key, value in (picture or {}).items() if key != "countdown_s"} | around
        if steady != self._picture or self._count % PARTICIPANT_EVERY == 0:
            self._picture = steady
            hub.show({Role.PARTICIPANT}, "picture", {"picture": picture, "screen": _screen(hub)} | around)

    def _ask_level(self, level: float | None) -> None:
        """Ask the machine for a gravity level, one request at a time. The guard applies its own ramp."""
        if level is None or not self._asking.is_over() or "set_level" not in self._hub.shown.possible:
            return
        # The end of a ramp is sent exactly.
        least = 0.0 if level in (0.0, EARTH, GRAVITY_LEVEL_MAX) else LEVEL_STEP
        if self._level is None or abs(level - self._level) > least:
            self._asking.begin(self._ask(level))

    async def _ask(self, level: float) -> None:
        hub = self._hub
        act = SetLevel(id=secrets.token_urlsafe(12), made_at_s=hub.desk.now(), gravity_level=level)
        answer = await hub.ask_desk(hub.desk.act, act, "operator")
        self._level = level if answer.taken else None

    async def _show_plots(self) -> None:
        hub = self._hub
        if not any(line.role in MACHINE for line in hub.lines.values()):
            return
        trace = await hub.ask_desk(hub.desk.trace, self._since)
        self._since = trace.next
        if trace.t:
            hub.show(MACHINE, "trace", {"trace": trace.model_dump(mode="json")})
        if self._count % POSES_EVERY == 0:
            hub.show(MACHINE, "pose", await self._pose())

    async def _pose(self) -> dict[str, Any]:
        """Position of machine and arms, and the key of the scene that the page fetches when it changes."""
        hub = self._hub
        skeleton, scene = await hub.ask_desk(hub.desk.skeleton), await hub.ask_desk(hub.desk.scene)
        arms = arms_of_line(skeleton.arm[0]) if skeleton.arm else []
        return {"q_rad": skeleton.q_rad, "arms": arms, "scene": None if scene is None else scene.key}

    def _show_state(self, t: float) -> None:
        hub = self._hub
        if not any(line.role in STEERED for line in hub.lines.values()):
            return
        fields: dict[str, Any] = {
            "shown": _shown(hub),
            "steers": hub.lease.held_by(t),
            "lost": None if hub.loss is None else {"cause": hub.loss.cause, "text": spoken(hub.loss.text)},
            # Age of the values: of the snapshot that an act may delay, and of the machine's report in it.
            "age_s": max(t - hub.shown.t, 0.0) + hub.shown.age_s,
            "lines": [{"line": line.number, "role": line.role.value} for line in hub.lines.values()],
            "alarms": [_alarm(alarm) for alarm in hub.alarms.open],
            "run": None,
            "aircraft": None if hub.feed is None else hub.feed.shown(t),
            "run_sets_level": False,
        }
        if hub.diary.why:
            hub.alarms.sound(hub.diary.why, t, "high")
        if hub.trial is not None and hub.trial.why_not_kept:
            hub.alarms.sound(hub.trial.why_not_kept, t, "high")
        if hub.trial is not None:
            fields |= {
                "run": _run(hub.trial, t),
                "run_sets_level": hub.trial.level(t) is not None,
                "protocol": _protocol(hub),
            }
        hub.show(STEERED, "state", fields)


def _shown(hub: Hub) -> dict[str, Any]:
    """Return the desk's snapshot, with sentences that a page can render in its language."""
    shown = hub.shown
    learning = None
    if shown.learning is not None:
        said = {"outcome": spoken(shown.learning.outcome), "help": spoken(shown.learning.help)}
        learning = shown.learning.model_dump(mode="json") | said
    rests = shown.rests
    if rests is not None:
        told = {"why_not": spoken(rests.why_not), "sentences": [spoken(one) for one in rests.sentences]}
        rests = rests.model_dump(mode="json") | told
    work = shown.work
    if work is not None:
        work = work.model_dump(mode="json") | {"phase": spoken(work.phase), "why": spoken(work.why)}
    return shown.model_dump(mode="json") | {
        "mode_text": spoken(shown.mode_text),
        "latch": None if shown.latch is None else spoken(shown.latch),
        "learning": learning,
        "rests": rests,
        "work": work,
        "alarms": [_alarm(alarm) for alarm in shown.alarms],
    }


def _run(trial: ProtocolTrial, t: float) -> dict[str, Any]:
    picture = trial.operator(t)
    return picture.model_dump(mode="json") | {"alarms": [_alarm(alarm) for alarm in picture.alarms]}


def _alarm(alarm: ConsoleAlarm | MachineAlarm | RunAlarm) -> dict[str, Any]:
    return alarm.model_dump(mode="json") | {"text": spoken(alarm.text)}


def _screen(hub: Hub) -> dict[str, Any] | None:
    screen = None if hub.trial is None else hub.trial.plan.screen
    return None if screen is None else screen.model_dump(mode="json")


def _protocol(hub: Hub) -> dict[str, Any] | None:
    if hub.trial is None:
        return None
    plan = hub.trial.plan
    return {
        "name": plan.protocol.name,
        "title": plan.protocol.title,
        "opening": plan.protocol.opening,
        "windows": plan.protocol.windows.count,
        "duration_s": plan.timeline.duration_s,
        "target": plan.protocol.target.model_dump(mode="json"),
        "screen": _screen(hub),
    }
