"""Fuzz test of the console's server: it must survive wrong messages, keep no memory of them, and still answer.

    python benchmarks/console_fuzz.py --messages 100000

Messages are seeded: noise, cut, grown, deeply nested, binary and huge texts, known messages with wrong fields, values
and types, and acts that are not allowed at that moment. Six connections send them and reconnect whenever the server
closes them. A seventh connection asks for the time and must get an answer. The server runs in its own process over a
rehearsed flight, so that its memory can be measured alone. Exit code 1 if the server died, grew by more than is
allowed, let a message through, or answered later than a lease lasts.
"""

import argparse
import asyncio
import contextlib
import json
import multiprocessing
import random
import statistics
import tempfile
import threading
import time
import urllib.request
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from exograv.console.event_log import EventLog
from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.lease import LEASE_S
from exograv.console.options import Address
from exograv.console.page_clocks import PageClocks
from exograv.console.serve import PageServer, bound, settings_of
from exograv.console.trial import ProtocolTrial
from exograv.console.trial_request import TrialRequest
from exograv.console.turnstile import Turnstile
from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.experiment.steered.session_controller import SessionController

LINES = 6
WARM_UP = 30_000
"""Messages before the first reading of memory, because buffers and tables fill. After 10 000 messages memory grew by
1.1 MB in 100 000 more, and by 1.2 MB in 400 000."""

GROWTH_MB = 1.0
"""Allowed growth per 100 000 messages: ten per million (docs/explanation/safety.md, F34)."""

ROLES = (Role.OPERATOR, Role.PARTICIPANT, Role.THERAPIST, Role.VIEWER)
KINDS = ("hello", "ping", "beat", "steer", "do", "run", "seen", "invite", "touches", "trail", "calibrate", "latency")
ODD: tuple[Any, ...] = (
    None,
    True,
    -1,
    0,
    1e308,
    -1e308,
    2**63,
    "",
    "x" * 600,
    "\x00",
    [],
    {},
    [[]],
    "NaN",
    "../..",
    "🦾",
)


def memory_mb() -> float:
    """Resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096 / 1e6


def serve_in_process(line: Connection, folder: Path) -> None:
    """Run a console; send its port and a token per connection, then its memory on each request."""
    flight, clocks = RehearsedFlight(), PageClocks()
    # The rehearsed flight would keep in memory what a real flight writes to the disk.
    flight.write = lambda topic, t, message: None
    desk = SessionController(flight)
    with bound(Address(port=0)) as (listening, host):
        diary = EventLog(folder / "fuzz.jsonl", lambda *_: None)
        plan = TrialRequest(folder, "training").plan()
        trial = None if plan is None else ProtocolTrial(plan, clocks, diary)
        hub = Hub(desk, trial, clocks, diary, f"http://{host}")
        hub.openings = Turnstile(1e6, 1000)  # lines are opened again at once after each wrong message
        tokens = [(role.value, hub.keys.token(role)) for role in ROLES for _ in range(2)]
        line.send((hub.origin, tokens))

        def answer_for_ever() -> None:
            while line.recv():
                line.send((memory_mb(), dict(hub.counts), hub.shown.mode))

        threading.Thread(target=answer_for_ever, daemon=True).start()
        PageServer(settings_of(hub, Address(port=0), host), hub).run(sockets=[listening])


class Nonsense:
    """Wrong messages from one seed."""

    def __init__(self, seed: int):
        """Seed the generator; the same seed gives the same messages."""
        self._random, self._count = random.Random(seed), 0

    def batch(self) -> list[str | bytes]:
        """Messages that keep a connection open, and a last one that closes it; the server reads all of them."""
        return [*(self._harmless() for _ in range(self._random.randrange(40))), self._closing()]

    def _name(self) -> str:
        self._count += 1
        return f"fuzz-{self._count:010d}"

    def _harmless(self) -> str:
        """Return a well-formed message whose request is impossible, or forbidden for most roles."""
        draw, t = self._random, time.monotonic() % 1e6
        kind = draw.choice(("ping", "beat", "steer", "seen", "do", "run", "trail"))
        fields: dict[str, Any] = {
            "ping": {"asked": draw.uniform(0, 1e8), "previous": {"asked": draw.uniform(0, 1e8), "back": 0.0}},
            "seen": {"id": self._name(), "of": draw.choice(("run", "console")), "alarm": draw.randrange(10**9)},
            "steer": {"id": self._name()},
            "do": {"id": self._name(), "made": t, "act": {"kind": draw.choice(("give_back", "switch_off"))}},
            "run": {"id": self._name(), "made": t, "word": draw.choice(("start", "resume", "open", "close"))},
            "trail": {"page": "page-of-fuzz", "sequence": 0, "ended": None, "points": [[t, 1.0, 2.0]]},
        }.get(kind, {})
        return json.dumps({"kind": kind, **fields})

    def _act(self, act: dict[str, Any]) -> str:
        return json.dumps({"kind": "do", "id": self._name(), "made": 1.0, "act": act})

    def _closing(self) -> str | bytes:
        draw = self._random
        good = self._harmless()
        noise = "".join(chr(draw.randrange(32, 0x2FFF)) for _ in range(draw.randrange(200)))
        wrong: list[str | bytes] = [
            noise,
            draw.randbytes(draw.randrange(1, 500)),
            good[: draw.randrange(1, len(good) - 1)],
            good + good,
            "[" * draw.randrange(1, 8000),
            '{"kind":' * draw.randrange(9, 1500),
            "x" * draw.randrange(16_385, 200_000),
            json.dumps({"kind": draw.choice(KINDS), "id": draw.choice(ODD), "made": draw.choice(ODD)}),
            self._act({"kind": "stop", "more": draw.choice(ODD)}),
            self._act({"kind": draw.choice(ODD)}),
            json.dumps({**json.loads(good), "more": draw.choice(ODD)}),
            json.dumps({"kind": "touches", "touches": [draw.choice(ODD) for _ in range(draw.randrange(40))]}),
        ]
        return draw.choice(wrong)


class Crowd:
    """Connections that send wrong messages, and one that asks for the time."""

    def __init__(self, origin: str, tokens: list[tuple[str, str]], messages: int):
        """Enter once per connection, each with its own link."""
        self._origin, self._left = origin, messages
        self._cookies = [(role, self._enter(token)) for role, token in tokens]
        self.closes, self.delays_ms, self.sent = Counter[int | None](), list[float](), 0

    def _post(self, path: str, headers: dict[str, str], body: bytes = b"") -> Any:
        known = {"Origin": self._origin, "X-Exograv": "1", **headers}
        request = urllib.request.Request(self._origin + path, body, known, method="POST")
        with urllib.request.urlopen(request, timeout=30.0) as response:
            return json.loads(response.read()), response.headers.get("Set-Cookie", "").partition(";")[0]

    def _enter(self, token: str) -> str:
        return self._post("/enter", {}, json.dumps({"token": token}).encode())[1]

    async def _opened(self, number: int) -> ClientConnection:
        """Open a connection and send its hello. There are eight places; a closed one may not be free yet, so retry."""
        role, cookie = self._cookies[number]
        answer, _ = await asyncio.to_thread(self._post, f"/{role}/ticket", {"Cookie": cookie})
        url, headers = f"{self._origin.replace('http', 'ws')}/{role}/line", {"Cookie": cookie}
        while True:
            try:
                opened = await connect(url, origin=self._origin, additional_headers=headers, compression=None)
            except InvalidStatus:
                await asyncio.sleep(0.01)
                continue
            hello = {"kind": "hello", "ticket": answer["ticket"], "page": f"page-of-{number:04d}"}
            await opened.send(json.dumps(hello))
            return opened

    async def misbehave(self, number: int, nonsense: Nonsense) -> None:
        """Send wrong messages until all are sent."""
        while self._left > 0:
            batch = nonsense.batch()
            self._left -= len(batch)
            async with await self._opened(number) as opened:
                with contextlib.suppress(ConnectionClosed):
                    for text in batch:
                        await opened.send(text)
                    while True:
                        await opened.recv()
                self.closes[opened.close_code] += 1
                self.sent += len(batch)

    async def ask_for_the_time(self, number: int) -> None:
        """Ask ten times a second until all wrong messages are sent."""
        async with await self._opened(number) as opened:
            while self._left > 0:
                begun = time.monotonic()
                await opened.send(json.dumps({"kind": "ping", "asked": begun % 1e6}))
                while json.loads(await opened.recv())["kind"] != "pong":
                    pass
                self.delays_ms.append(1e3 * (time.monotonic() - begun))
                await asyncio.sleep(0.1)

    async def run(self, seed: int) -> None:
        """Run all connections at once."""
        liars = (self.misbehave(number, Nonsense(1000 * seed + number)) for number in range(LINES))
        await asyncio.gather(self.ask_for_the_time(LINES), *liars)


def fuzz(messages: int, seed: int) -> dict[str, Any]:
    """Run one campaign against a new server; memory is read after a warm-up and at the end."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    with tempfile.TemporaryDirectory() as folder:
        server = context.Process(target=serve_in_process, args=(theirs, Path(folder)))
        server.start()
        try:
            origin, tokens = ours.recv()
            crowd = Crowd(origin, tokens, max(messages // 10, WARM_UP))
            asyncio.run(crowd.run(seed))
            ours.send(True)
            before_mb, *_ = ours.recv()
            crowd.closes.clear()
            crowd.delays_ms.clear()
            crowd.sent, crowd._left = 0, messages
            begun = time.monotonic()
            asyncio.run(crowd.run(seed + 1))
            seconds = time.monotonic() - begun
            ours.send(True)
            after_mb, counts, mode = ours.recv()
        finally:
            server.terminate()
            server.join(10.0)
    delays = sorted(crowd.delays_ms)
    return {
        "messages": crowd.sent,
        "seconds": round(seconds, 1),
        "growth_MB": round(after_mb - before_mb, 2),
        "closes": {str(code): count for code, count in sorted(crowd.closes.items(), key=str)},
        "counted": counts,
        "mode": mode,
        "answered_ms": {
            "median": round(statistics.median(delays), 1),
            "p99": round(delays[int(0.99 * (len(delays) - 1))], 1),
            "max": round(delays[-1], 1),
        },
    }


def main() -> None:
    """Run the campaign, print its figures, and exit with 1 on a failure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--messages", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1000)
    asked = parser.parse_args()
    result = fuzz(asked.messages, asked.seed)
    print(json.dumps(result, indent=1))
    allowed_mb = max(GROWTH_MB, 10e-6 * result["messages"])
    # 1006: the connection broke off, because the server closed it while a huge message was still arriving.
    wrong = set(result["closes"]) - {"1002", "1006", "1008", "1009"}
    late = result["answered_ms"]["max"] > 1e3 * LEASE_S
    if result["growth_MB"] > allowed_mb or wrong or late or result["mode"] != "off":
        raise SystemExit("The server grew, died, let something through, or answered too late.")


if __name__ == "__main__":
    main()
