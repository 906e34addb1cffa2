"""Pages without a browser: their messages, and the answers to them."""

import asyncio
import itertools
import json
from collections.abc import Coroutine
from typing import Any

from exograv.console.handlers import hear
from exograv.console.hub import Hub, PageLine
from exograv.console.keys import PageSession, Role

from .of_clock import SetClock

_NUMBERS = itertools.count(1)
PAGE = "page-of-a-test"


def page(hub: Hub, role: Role, clock: SetClock | None = None) -> PageLine:
    """Open a line of a logged-in page with a known clock, a hundred seconds behind the desk's."""
    line = hub.open(PageSession(role, next(_NUMBERS)), f"{PAGE}-{next(_NUMBERS)}")
    if clock is not None:
        told(hub, line, {"kind": "ping", "asked": clock.t - 100.0})
        told(hub, line, {"kind": "ping", "asked": clock.t - 100.0, "previous": pinged(clock)})
    return line


def pinged(clock: SetClock) -> dict[str, float]:
    return {"asked": clock.t - 100.0, "back": clock.t - 100.0}


def told(hub: Hub, line: PageLine, *messages: dict[str, Any] | str) -> list[dict[str, Any]]:
    """Send messages and return the answers."""

    async def say() -> None:
        for message in messages:
            await hear(hub, line, message if isinstance(message, str) else json.dumps(message))
        hub.shown = hub.desk.shown()

    run(say())
    words = [json.loads(text) for text in line.outbox._words]
    line.outbox._words.clear()
    return words


def run(what: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine in a loop of its own."""
    asyncio.run(what)


def answer(words: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the only answer."""
    (only,) = [word for word in words if word["kind"] == "answer"]
    why = (only["answer"]["why"] or {"text": ""})["text"]
    return only["answer"] | {"why": why} | {key: value for key, value in only.items() if key not in ("kind", "answer")}


def name() -> str:
    return f"name-{next(_NUMBERS):08d}"


def do(
    clock: SetClock, kind: str, seen_version: int | None = None, age_s: float = 0.0, **fields: Any
) -> dict[str, Any]:
    """Message of an act, as a page sends it."""
    seen = {} if seen_version is None else {"seen_version": seen_version}
    return {"kind": "do", "id": name(), "made": clock.t - 100.0 - age_s, "act": {"kind": kind, **fields}, **seen}


def touch(clock: SetClock, sequence: int, page: str, age_s: float = 0.0, **changes: Any) -> dict[str, Any]:
    """Message of a touch three pixels right of the centre and four below."""
    usual = {
        "page": page, "origin_ms": 1.7e12, "at": clock.t - 100.0 - age_s, "sequence": sequence, "x_px": 963.0,
        "y_px": 544.0, "target_x_px": 960.0, "target_y_px": 540.0, "width_px": 10.0, "height_px": 12.0,
        "pressure": 0.5, "pointer": "touch", "is_primary": True, "ratio": 2.0, "zoom": 1.0,
    }  # fmt: skip
    return usual | changes
