"""Handlers of the pages' messages. Format, role and lease are checked first, in one place, for every message."""

from collections.abc import Awaitable, Callable
from typing import Any

from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.experiment.steered.requests import ACT, LATE_S, Answer

from .hub import NOT_STEERING, Hub, PageLine
from .keys import Role
from .limits import Close
from .messages import (
    ActMessage,
    AlarmSeen,
    Calibrate,
    Heartbeat,
    Hello,
    InviteRequest,
    Latency,
    LeaseRequest,
    Message,
    Ping,
    RunCommand,
    Touches,
    TouchTrail,
    read_message,
)
from .permissions import ACTS, WITHOUT_LEASE, may_say, word
from .sentences import say, spoken

CLOCK_UNKNOWN = say("console.clock_unknown")
MOTORS = ("make_ready", "take_arm", "identify")
"""Acts that switch motors on. In flight they are refused: the motors would accelerate an arm that weighs nothing."""


async def hear(hub: Hub, line: PageLine, text: str | bytes) -> None:
    """Handle one message of a page. If the line must end for it, the reason is set in `line.end`."""
    t = hub.desk.now()
    message = Close.POLICY if not line.rate.allows(t) else read_message(text)
    # A second hello breaks the protocol of the line, and so does an act that does not exist.
    if isinstance(message, Hello) or (isinstance(message, ActMessage) and message.act.get("kind") not in ACTS):
        message = Close.POLICY
    if isinstance(message, Close):
        line.end = message
    elif not may_say(line.role, message):
        hub.alarms.sound(say("alarm.role", role=line.role.value, word=word(message)), t, "medium")
        hub.note("role refused", line, word=word(message))
        _answer(line, message, say("console.not_allowed"))
    elif word(message) not in WITHOUT_LEASE and not hub.steers(line):
        _answer(line, message, NOT_STEERING)
    else:
        handle: Callable[[Hub, PageLine, Any, float], Awaitable[None]] = HANDLERS[type(message)]
        await handle(hub, line, message, t)


def _answer(line: PageLine, message: Message, why: str, taken: bool = False, **fields: Any) -> None:
    name = getattr(message, "id", None)
    if name is not None:
        line.say("answer", answer=said(Answer(id=name, taken=taken, why=why)), **fields)


def said(answer: Answer) -> dict[str, Any]:
    """Return an answer in the form of a line."""
    return {"id": answer.id, "taken": answer.taken, "why": spoken(answer.why) if answer.why else None}


async def _ping(hub: Hub, line: PageLine, ping: Ping, t: float) -> None:
    answered = hub.desk.now()
    hub.clocks.ping(line.page, ping, t, answered)
    line.say("pong", asked=ping.asked, heard=t, answered=answered)


async def _beat(hub: Hub, line: PageLine, beat: Heartbeat, t: float) -> None:
    if beat.gap is not None:
        hub.explain_loss(line, beat.gap.cause, beat.gap.seconds, t)
    if hub.lease.beat(line.number, t, beat.hidden):
        window = None if hub.trial is None or hub.trial.run.state.window is None else hub.trial.operator(t)
        hub.desk.keep(None if window is None else window.countdown_s)


async def _steer(hub: Hub, line: PageLine, steer: LeaseRequest, t: float) -> None:
    taken = hub.lease.ask(line.number, t)
    hub.note("asked to steer", line, taken=taken)
    _answer(line, steer, "" if taken else say("console.other_steers"), taken)


async def _do(hub: Hub, line: PageLine, do: ActMessage, t: float) -> None:
    if do.act["kind"] == "set_level" and hub.trial is not None and hub.trial.level(t) is not None:
        _answer(line, do, say("console.level_is_set"))
        return
    if do.act["kind"] in MOTORS and hub.trial is not None and hub.trial.plan.protocol.opening == "aircraft":
        _answer(line, do, say("console.in_flight"))
        return
    if do.act["kind"] == "don" and hub.trial is not None and hub.trial.is_running:
        _answer(line, do, say("console.runs"))
        return
    if do.act["kind"] == "learn_rest" and hub.trial is not None and (why := hub.trial.why_no_rest(t)):
        _answer(line, do, why)
        return
    placed = hub.clocks.place(line.page, do.made)
    if placed is None and do.act["kind"] != "stop":
        _answer(line, do, CLOCK_UNKNOWN)
        return
    # A stop is valid whenever it was pressed. The clock fit may be slightly wrong: no act is made after its arrival.
    made = t if placed is None or do.act["kind"] == "stop" else min(placed.t, t)
    seen = {} if do.seen_version is None else {"seen_version": do.seen_version}
    try:
        act = ACT.validate_python({**do.act, **seen, "id": do.id, "made_at_s": made})
    except ValidationError:
        line.end = Close.POLICY
        return
    if act.kind == "stop" and hub.trial is not None:
        hub.trial.interrupt(t, f"Stop was pressed: {line.role.value}")
    answer = await hub.act(act, line)
    if act.kind == "agree" and answer.taken and hub.trial is not None:
        hub.trial.agreed(hub.desk.now())
    line.say("answer", answer=said(answer))


async def _run(hub: Hub, line: PageLine, asked: RunCommand, t: float) -> None:
    if hub.trial is None:
        _answer(line, asked, say("console.no_protocol"))
        return
    placed = hub.clocks.place(line.page, asked.made)
    if placed is None or t - placed.t > LATE_S:
        _answer(line, asked, CLOCK_UNKNOWN if placed is None else say("console.late"))
        return
    why = hub.trial.word(asked, t, hub.shown)
    _answer(line, asked, why, taken=not why)


async def _seen(hub: Hub, line: PageLine, seen: AlarmSeen, t: float) -> None:
    if seen.of == "console":
        why = "" if hub.alarms.acknowledge(seen.alarm) else say("console.no_alarm")
    else:
        why = say("console.no_protocol") if hub.trial is None else hub.trial.acknowledge(seen.alarm, t)
    hub.note("alarm acknowledged", line, of=seen.of, alarm=seen.alarm, taken=not why)
    _answer(line, seen, why, taken=not why)


async def _invite(hub: Hub, line: PageLine, invite: InviteRequest, t: float) -> None:
    link = f"{hub.origin}/#{hub.keys.token(Role(invite.role))}"
    hub.note("link made", line, invited=invite.role)
    _answer(line, invite, "", taken=True, link=link)


async def _touches(hub: Hub, line: PageLine, touches: Touches, t: float) -> None:
    for raw in touches.touches:
        judged = None if hub.trial is None else hub.trial.touch(raw, t)
        verdict = None if judged is None else judged.is_accepted
        line.say("touched", page=raw.page, sequence=raw.sequence, accepted=verdict)


async def _trail(hub: Hub, line: PageLine, trail: TouchTrail, t: float) -> None:
    hub.diary.write("/console/trail", t, trail.model_dump(mode="json"))


async def _calibrate(hub: Hub, line: PageLine, measured: Calibrate, t: float) -> None:
    if hub.trial is None:
        _answer(line, measured, say("console.no_protocol"))
        return
    try:
        hub.trial.calibrate(measured, t)
    except ConfigError as error:
        _answer(line, measured, str(error))
    else:
        screen = hub.trial.plan.screen
        _answer(line, measured, "", taken=True, screen=None if screen is None else screen.model_dump(mode="json"))


async def _latency(hub: Hub, line: PageLine, latency: Latency, t: float) -> None:
    hub.diary.write("/console/latency", t, latency.model_dump(mode="json"))
    _answer(line, latency, "", taken=True)


HANDLERS: dict[type, Callable[[Hub, PageLine, Any, float], Awaitable[None]]] = {
    Ping: _ping,
    Heartbeat: _beat,
    LeaseRequest: _steer,
    ActMessage: _do,
    RunCommand: _run,
    AlarmSeen: _seen,
    InviteRequest: _invite,
    Touches: _touches,
    TouchTrail: _trail,
    Calibrate: _calibrate,
    Latency: _latency,
}
