"""State of one running console: desk, trial, keys, lease, alarms, and lines, which are the connections to the pages."""

import asyncio
import json
from collections import Counter
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

from exograv.experiment.steered.requests import Act, Answer, Desk

from .alarms import Alarms
from .event_log import EventLog
from .feed import Feed
from .keys import AccessKeys, PageSession, Role
from .lease import Lease
from .lease_loss import Cause, LeaseLoss
from .limits import CLIENTS_MAX, LINES_RESERVED, Close, Rate
from .outbox import Outbox
from .page_clocks import PageClocks
from .sentences import say, spoken
from .trial import ProtocolTrial
from .turnstile import LINES_AT_ONCE, LINES_PER_S, Turnstile

Result = TypeVar("Result")
UNMANNED = ("off", "starting")
"""Modes that need no steering page."""

ACTS_WAITING_MAX = 8
"""Largest number of acts that wait for the act before them. Further acts are refused."""


@dataclass
class PageLine:
    """Open line to one page."""

    number: int
    """Unique number of the line."""

    session: PageSession
    page: str
    outbox: Outbox = field(default_factory=Outbox)
    rate: Rate = field(default_factory=Rate)
    end: Close | None = None
    """Reason to end the line; None while it is open."""

    @property
    def role(self) -> Role:
        """Role of the page."""
        return self.session.role

    def say(self, kind: str, **fields: Any) -> None:
        """Send a message that must arrive."""
        self.outbox.say(as_text(kind, **fields))


class Hub:
    """Shared state of request handlers, broadcaster and connections to the pages, all in one event loop."""

    def __init__(
        self,
        desk: Desk,
        trial: ProtocolTrial | None,
        clocks: PageClocks,
        diary: EventLog,
        origin: str,
        keys: AccessKeys | None = None,
    ):
        """Start without pages.

        Args:
            desk: Session controller of the steered session.
            trial: Protocol that runs; None if only the machine is steered.
            clocks: Clocks of the pages.
            diary: Log of all events.
            origin: Origin of the pages for links, such as `http://127.0.0.1:8088`.
            keys: Keys of the pages; None for new ones.
        """
        self.feed: Feed | None = None
        """Feed of the aircraft, if an aircraft opens the trial's windows."""

        self.desk, self.trial, self.clocks, self.diary, self.origin = desk, trial, clocks, diary, origin
        self.shown = desk.shown()
        """Latest snapshot of the desk. A new one may have to wait for an act that the desk decides about."""

        self.keys = AccessKeys(desk.now) if keys is None else keys
        self.lease, self.alarms = Lease(), Alarms()
        self.loss: LeaseLoss | None = None
        """Last loss of the lease, for the pages."""

        self.lines = dict[int, PageLine]()
        self.counts = dict[str, int]()
        """Number of ended lines by reason."""

        self.coming = Counter[Role]()
        """Number of lines without a hello so far, by role."""

        self.openings = Turnstile(LINES_PER_S, LINES_AT_ONCE)
        """Rate limit of lines by login."""

        self.failure: Exception | None = None
        """Programming error that ends the console."""

        self.on_failure: Callable[[], None] = lambda: None
        """Function that ends the server."""

        self._opened = 0
        self._turn = asyncio.Lock()
        self._waiting = 0
        # Stop has threads of its own, so that it never waits for another act.
        self._threads = ThreadPoolExecutor(2, "acts")
        self._stops = ThreadPoolExecutor(2, "stop")
        self._looks = ThreadPoolExecutor(3, "look")

    def open(self, session: PageSession, page: str) -> PageLine:
        """Open the connection of a page. An operator or therapist gets the lease if no page holds it."""
        self._opened += 1
        line = PageLine(self._opened, session, page)
        self.lines[line.number] = line
        self.note("line opened", line)
        if line.role in (Role.OPERATOR, Role.THERAPIST):
            self.lease.ask(line.number, self.desk.now())
        return line

    def has_room(self, role: Role) -> bool:
        """Return True if another line of this role may open. Lines that other roles have reserved stay free."""
        used = Counter(line.role for line in self.lines.values()) + self.coming
        reserved = sum(max(most - used[other], 0) for other, most in LINES_RESERVED.items() if other is not role)
        return used.total() + reserved < CLIENTS_MAX

    def close(self, line: PageLine) -> None:
        """Close a line and release its lease."""
        del self.lines[line.number]
        if line.end is not None:
            self.count(line.end)
        t = self.desk.now()
        if line.number in (self.lease.holder, self.lease.expired):
            self.lease.expired = None
            cause = "refused" if line.end in (Close.POLICY, Close.PROTOCOL, Close.TOO_BIG) else "closed"
            self.lose(LeaseLoss(line.number, line.page, cause, self.lease.silent_s(t)), t)
        self.lease.give_up(line.number)
        self.note("line closed", line)

    def lose(self, loss: LeaseLoss, t: float) -> None:
        """Keep the reason of a lost lease, and raise an alarm if the machine needs a steering page."""
        self.loss = loss
        if self.shown.mode not in UNMANNED and not self.alarms.explain(say("alarm.silent", line=loss.line), loss.text):
            self.alarms.sound(loss.text, t, "high")
        what = {"what": "lease lost", "line": loss.line, "cause": loss.cause, "seconds": round(loss.seconds, 3)}
        self.diary.write("/console/event", t, what)

    def explain_loss(self, line: PageLine, cause: Cause, seconds: float, t: float) -> None:
        """Take the reason that a page gives for its own silence, once it is back."""
        if self.loss is None or self.loss.page != line.page or self.loss.cause in (cause, "closed", "refused"):
            return
        before, self.loss = self.loss, LeaseLoss(self.loss.line, line.page, cause, seconds)
        self.alarms.explain(before.text, self.loss.text)
        self.note("lease loss explained", line, cause=cause, seconds=round(seconds, 3))

    def farewell(self) -> None:
        """Tell all pages that the session ends, before the server closes their lines."""
        why = spoken(say("console.failed" if self.failure is not None else "console.ended"))
        for line in self.lines.values():
            line.say("ended", why=why, failed=self.failure is not None)

    def note(self, what: str, line: PageLine, **fields: Any) -> None:
        """Write an event of the connection to a page into the log of all events."""
        who = {"line": line.number, "role": line.role.value, "session": line.session.number}
        self.diary.write("/console/event", self.desk.now(), {"what": what, **who, **fields})

    def count(self, why: Close) -> None:
        """Count a line that ended for this reason."""
        self.counts[why.name] = self.counts.get(why.name, 0) + 1

    def steers(self, line: PageLine) -> bool:
        """Return True if this line holds the lease."""
        return self.lease.held_by(self.desk.now()) == line.number

    async def act(self, act: Act, line: PageLine) -> Answer:
        """Let the session controller decide about a request. Requests run one after the other; Stop runs at once."""
        loop = asyncio.get_running_loop()
        if act.kind == "stop":
            return await loop.run_in_executor(self._stops, self.desk.act, act, line.role.value)
        if self._waiting >= ACTS_WAITING_MAX:
            return Answer(id=act.id, taken=False, why=say("console.too_many"))
        self._waiting += 1
        try:
            async with self._turn:
                if act.kind != "agree" and not self.steers(line):
                    return Answer(id=act.id, taken=False, why=NOT_STEERING)
                return await loop.run_in_executor(self._threads, self.desk.act, act, line.role.value)
        finally:
            self._waiting -= 1

    async def look(self) -> None:
        """Update the snapshot of the desk."""
        self.shown = await self.ask_desk(self.desk.shown)

    async def ask_desk(self, question: Callable[..., Result], *values: Any) -> Result:
        """Ask the desk in a thread, because the answer may have to wait."""
        return await asyncio.get_running_loop().run_in_executor(self._looks, question, *values)

    def show(self, roles: Collection[Role], kind: str, fields: dict[str, Any]) -> None:
        """Send a message to all pages of these roles."""
        lines = [line for line in self.lines.values() if line.role in roles]
        if lines:
            text = as_text(kind, **fields)
            for line in lines:
                line.outbox.show(kind, text)

    def fail(self, error: Exception) -> None:
        """End the console after an error. Without the operator's page, the guard returns the weight to the person."""
        self.failure = self.failure or error
        self.on_failure()

    def close_down(self) -> None:
        """Accept no more acts."""
        for threads in (self._threads, self._stops, self._looks):
            threads.shutdown(wait=False, cancel_futures=True)


NOT_STEERING = say("console.not_steering")


def as_text(kind: str, **fields: Any) -> str:
    """Return a message in the form of a line."""
    return json.dumps({"kind": kind, **fields}, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
