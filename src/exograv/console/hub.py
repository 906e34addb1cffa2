"""Everything of one running console: desk, trial, keys, lease, alarms, and the lines to the pages."""

import asyncio
import json
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
from .limits import Close, Rate
from .outbox import Outbox
from .page_clocks import PageClocks
from .sentences import say
from .trial import ProtocolTrial

Result = TypeVar("Result")
UNMANNED = ("off", "starting")
"""Modes in which nobody has to steer."""

ACTS_WAITING_MAX = 8
"""Acts that wait for the one before them; whoever presses on is refused."""


@dataclass
class PageLine:
    """An open line to one page."""

    number: int
    """Never used twice."""

    session: PageSession
    page: str
    outbox: Outbox = field(default_factory=Outbox)
    rate: Rate = field(default_factory=Rate)
    end: Close | None = None
    """Why it has to end; set by whoever finds a reason."""

    @property
    def role(self) -> Role:
        """As whom somebody came in."""
        return self.session.role

    def say(self, kind: str, **fields: Any) -> None:
        """A word that must arrive."""
        self.outbox.say(as_text(kind, **fields))


class Hub:
    """Handlers, news and lines meet here, all of them in one event loop."""

    def __init__(self, desk: Desk, trial: ProtocolTrial | None, clocks: PageClocks, diary: EventLog, origin: str):
        """Nobody is there yet.

        Args:
            desk: Of the steered session.
            trial: The protocol that is run; None where only the machine is steered.
            clocks: Of the pages.
            diary: Where all that happens is kept.
            origin: Where pages are served, for links: `http://127.0.0.1:8088`.
        """
        self.feed: Feed | None = None
        """Of the aircraft, if one opens the trial's windows."""

        self.desk, self.trial, self.clocks, self.diary, self.origin = desk, trial, clocks, diary, origin
        self.shown = desk.shown()
        """The latest; asking the desk may wait for an act that it is deciding about."""

        self.keys, self.lease, self.alarms = AccessKeys(desk.now), Lease(), Alarms()
        self.lines = dict[int, PageLine]()
        self.counts = dict[str, int]()
        """Lines that were ended, by the reason."""

        self.coming = 0
        """Lines that have not said hello yet."""

        self.failure: Exception | None = None
        """A mistake of ours, after which nothing goes on."""

        self.on_failure: Callable[[], None] = lambda: None
        """Ends the server."""

        self._opened = 0
        self._turn = asyncio.Lock()
        self._waiting = 0
        # Stop never waits for another act: it has threads of its own.
        self._threads = ThreadPoolExecutor(2, "acts")
        self._stops = ThreadPoolExecutor(2, "stop")
        self._looks = ThreadPoolExecutor(3, "look")

    def open(self, session: PageSession, page: str) -> PageLine:
        """Somebody is there; an operator steers if nobody does."""
        self._opened += 1
        line = PageLine(self._opened, session, page)
        self.lines[line.number] = line
        self.note("line opened", line)
        if line.role in (Role.OPERATOR, Role.THERAPIST):
            self.lease.ask(line.number, self.desk.now())
        return line

    def close(self, line: PageLine) -> None:
        """Nobody is there any more."""
        del self.lines[line.number]
        if line.end is not None:
            self.count(line.end)
        if self.lease.holder == line.number and self.shown.mode not in UNMANNED:
            self.alarms.sound(say("alarm.closed"), self.desk.now(), "high")
        self.lease.give_up(line.number)
        self.note("line closed", line)

    def note(self, what: str, line: PageLine, **fields: Any) -> None:
        """Keep that somebody did something."""
        who = {"line": line.number, "role": line.role.value, "session": line.session.number}
        self.diary.write("/console/event", self.desk.now(), {"what": what, **who, **fields})

    def count(self, why: Close) -> None:
        """One more line that was ended for this."""
        self.counts[why.name] = self.counts.get(why.name, 0) + 1

    def steers(self, line: PageLine) -> bool:
        """Whether this is the one page whose words are taken."""
        return self.lease.held_by(self.desk.now()) == line.number

    async def act(self, act: Act, line: PageLine) -> Answer:
        """Have the desk decide. One act after the other, but for Stop, which goes at once."""
        loop = asyncio.get_running_loop()
        if act.kind == "stop":
            return await loop.run_in_executor(self._stops, self.desk.act, act, line.role.value)
        if self._waiting >= ACTS_WAITING_MAX:
            return Answer(id=act.id, taken=False, why=say("console.too_many"))
        self._waiting += 1
        try:
            async with self._turn:
                if not self.steers(line):
                    return Answer(id=act.id, taken=False, why=NOT_STEERING)
                return await loop.run_in_executor(self._threads, self.desk.act, act, line.role.value)
        finally:
            self._waiting -= 1

    async def look(self) -> None:
        """Ask the desk how things are."""
        self.shown = await self.ask_desk(self.desk.shown)

    async def ask_desk(self, question: Callable[..., Result], *values: Any) -> Result:
        """What may have to wait, in a thread that may."""
        return await asyncio.get_running_loop().run_in_executor(self._looks, question, *values)

    def show(self, roles: Collection[Role], kind: str, fields: dict[str, Any]) -> None:
        """News for everybody in these roles."""
        lines = [line for line in self.lines.values() if line.role in roles]
        if lines:
            text = as_text(kind, **fields)
            for line in lines:
                line.outbox.show(kind, text)

    def fail(self, error: Exception) -> None:
        """End all; without the operator's page the guard gives the arm back."""
        self.failure = self.failure or error
        self.on_failure()

    def close_down(self) -> None:
        """No more acts."""
        for threads in (self._threads, self._stops, self._looks):
            threads.shutdown(wait=False, cancel_futures=True)


NOT_STEERING = say("console.not_steering")


def as_text(kind: str, **fields: Any) -> str:
    """As it goes over a line."""
    return json.dumps({"kind": kind, **fields}, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
