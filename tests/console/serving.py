"""Console in this process on the fake desk: with a real server in a thread, or for Starlette's test client."""

import asyncio
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import uvicorn
from tests.waiting import wait_until

from exograv.console.event_log import EventLog
from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.limits import Close
from exograv.console.options import Address
from exograv.console.page_clocks import PageClocks
from exograv.console.serve import PageServer, bound, settings_of
from exograv.console.trial import ProtocolTrial
from exograv.task.plan import TaskPlan

from .fake_desk import FakeDesk


@contextmanager
def hub_on(desk: FakeDesk, folder: Path, plan: TaskPlan | None, origin: str = "http://127.0.0.1:8088") -> Iterator[Hub]:
    """Build a console without its server."""
    clocks = PageClocks()
    diary = EventLog(folder / "console.jsonl", desk.write)
    hub = Hub(desk, None if plan is None else ProtocolTrial(plan, clocks, diary), clocks, diary, origin)
    try:
        yield hub
    finally:
        hub.close_down()
        diary.close()


def network_address(folder: Path) -> Address:
    """Make a certificate; return an address of a network that only this computer reaches."""
    certificate, key = folder / "c.pem", folder / "k.pem"
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=127.0.0.2"]
    try:
        subprocess.run([*made, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    except FileNotFoundError:
        pytest.skip("There is no openssl to make a certificate with.")
    return Address(port=0, lan="127.0.0.2", certificate=certificate, key=key)


@dataclass
class Served:
    """Running server."""

    hub: Hub
    desk: FakeDesk
    server: uvicorn.Server
    loop: asyncio.AbstractEventLoop

    def link(self, role: Role) -> str:
        """Link for one person."""
        return f"{self.hub.origin}/#{self.hub.keys.token(role)}"

    def cut_off(self, role: Role) -> None:
        """End the lines of these pages, as a broken network would."""

        def end() -> None:
            for line in self.hub.lines.values():
                if line.role is role:
                    line.end = Close.GOING_AWAY
                    line.outbox.say("{}")

        self.loop.call_soon_threadsafe(end)


@contextmanager
def served(
    folder: Path, plan: TaskPlan | None, desk: FakeDesk | None = None, address: Address | None = None
) -> Iterator[Served]:
    """Run a server in a thread, and end it at the end."""
    desk, address = desk or FakeDesk(), address or Address(port=0)
    with bound(address) as (listening, host), hub_on(desk, folder, plan, f"{address.scheme}://{host}") as hub:
        server = PageServer(settings_of(hub, address, host), hub)
        loop = asyncio.new_event_loop()
        thread = threading.Thread(target=lambda: loop.run_until_complete(server.serve(sockets=[listening])))
        thread.start()
        try:
            wait_until(lambda: server.started or not thread.is_alive(), "a server")
            yield Served(hub, desk, server, loop)
        finally:
            server.should_exit = True
            thread.join(10.0)
            loop.close()
