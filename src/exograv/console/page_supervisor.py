"""Parent's side of the process of the pages: start it, replace it when it is dead or hangs, end it with the session."""

import contextlib
import os
import secrets
import tempfile
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from exograv.errors import ExogravError
from exograv.experiment.steered.requests import Desk
from exograv.runtime.processes.supervisor import Supervisor

from .desk_link import DeskLink, Ended
from .keys import SECRET_BYTES, Role
from .page_process import PageJob, serve_pages
from .serve import END_S

CHECK_S = 0.05
"""Period in which the process is checked [s]."""

START_MAX_S = 60.0
"""Time for a process to accept connections [s]."""

HANGS_S = 3.0
"""Time without a request after which a process counts as hanging [s]. It asks for the state ten times a second."""

LASTS_S = 30.0
"""Life of a process after which its end does not count as fruitless [s]."""

FRUITLESS_MAX = 3
"""Largest number of fruitless processes in a row that are replaced."""

ENDS_S = END_S + 2.0
"""Time for the process to close its lines and files at the end of the session [s]."""

Say = Callable[[str], None]
"""Function that shows a line to the operator."""


class PageSupervisor:
    """Process of the pages with its replacements. All use the same port, cookies and diary, so that pages reconnect."""

    def __init__(
        self,
        desk: Desk,
        job: Callable[[DeskLink], PageJob],
        opens_browser: bool,
        say: Say,
        steer: Callable[[str], object] | None = None,
    ):
        """Start the first process.

        Args:
            desk: Desk of the session.
            job: Function that makes the job of the first process for its link.
            opens_browser: True to open the operator's link in this computer's browser.
            say: Function that shows a line to the operator.
            steer: Function that takes the operator's link, which is then not shown; None to show it.
        """
        self._desk, self._opens_browser, self._say, self._steer = desk, opens_browser, say, steer
        self._link = DeskLink(desk)
        self._job = job(self._link)
        self._child = Supervisor("pages", serve_pages, self._job, FRUITLESS_MAX)
        self._files = contextlib.ExitStack()
        self._begin()

    @property
    def pid(self) -> int:
        """Identifier of the present process."""
        return self._child.pid

    def run(self, is_over: threading.Event) -> None:
        """Replace processes that end or hang, until `is_over` is set.

        Raises:
            ExogravError: Too many processes in a row ended at once, or the desk failed.
        """
        while not is_over.wait(CHECK_S):
            self._check()

    def end(self) -> Ended | None:
        """End the process, and return its last report; None if it had to be killed."""
        self._child.end(ENDS_S)
        self._link.close()
        self._files.close()
        return self._link.ended

    def _begin(self) -> None:
        self._checked = self._begun = self._heard = time.monotonic()
        self._is_ready = False

    def _check(self) -> None:
        now, link = time.monotonic(), self._link
        if now - self._checked > HANGS_S / 2.0:
            self._heard = now  # this process stood still, not the pages
        self._checked, self._heard = now, max(self._heard, link.heard_at)
        if link.failure is not None:
            raise ExogravError(
                f"The session ended by a programming error: {link.failure!r}. The guard of the machine lowers the arm "
                "by itself. Please report this with the last lines of the diary."
            ) from link.failure
        if link.ready is not None and not self._is_ready:
            self._is_ready = True
            self._show_link(link.ready.aircraft_port)
        if why := self._why_replaced(now):
            self._replace(why, now)

    def _why_replaced(self, now: float) -> str:
        if not self._child.is_alive:
            return f"ended (exit status {self._child.exit_status})"
        if self._link.why_broken:
            return f"sent a wrong request ({self._link.why_broken})"
        silent_max_s = HANGS_S if self._is_ready else START_MAX_S
        return f"was silent for {silent_max_s:g} s" if now - self._heard > silent_max_s else ""

    def _replace(self, why: str, now: float) -> None:
        is_fruitless = not self._is_ready or now - self._begun < LASTS_S
        self._child.kill()
        self._link.close()
        self._link = DeskLink(self._desk)
        self._job = replace(self._job, names=self._link.names, operator_token=new_token(), number=self._job.number + 1)
        if not self._child.replace(self._job, is_fruitless):
            raise ExogravError(
                f"The process of the pages {why}, as {FRUITLESS_MAX} before it. The guard of the machine lowers the "
                "arm by itself. The output above gives the reason; please report it with the last lines of the diary."
            )
        self._say(f"The process of the pages {why}, and was started again. Open pages reconnect by themselves.")
        self._begin()

    def _show_link(self, aircraft_port: int | None) -> None:
        if aircraft_port is not None:
            self._say(f"The console listens to the aircraft on UDP port {aircraft_port}.")
        job = self._job
        link = f"{job.address.scheme}://{job.host}/#{job.operator_token}"
        if self._steer is not None:
            self._steer(link)
            return
        which = "this link once" if job.number == 0 else "this new link only if the operator's page is gone"
        self._say(f"Open {which}, as the {Role.OPERATOR.value}: {link}")
        if self._opens_browser and job.number == 0:
            self._files.enter_context(_opened(link))


def new_token() -> str:
    """Return a new token for the operator's link."""
    return secrets.token_urlsafe(SECRET_BYTES)


@contextlib.contextmanager
def _opened(link: str) -> Iterator[None]:
    """Open the link in a browser by a file that only its owner can read: program arguments are visible to all users."""
    with tempfile.TemporaryDirectory(prefix="exograv-console-") as folder:
        path = Path(folder) / "open.html"
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o600), "w", encoding="utf-8") as file:
            file.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={link}"><title>exograv</title>\n')
        webbrowser.open(path.as_uri())
        yield
