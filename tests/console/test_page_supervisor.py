"""Pages whose process is killed or hangs come back on the same port with their login, and the session goes on."""

import os
import re
import resource
import signal
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from tests.waiting import wait_until
from websockets.exceptions import ConnectionClosed

from exograv.console.desk_link import DeskLink
from exograv.console.options import Address
from exograv.console.page_process import DESCRIPTORS_MAX, PageJob
from exograv.console.page_supervisor import FRUITLESS_MAX, PageSupervisor, new_token
from exograv.console.run import ended_by_ctrl_c
from exograv.console.serve import bound
from exograv.console.trial_request import TrialRequest
from exograv.errors import ExogravError
from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.experiment.steered.session_controller import SessionController

from .of_process import Page, short_file


class Pages:
    """Pages in a process of their own, over a rehearsed flight in this one."""

    def __init__(self, supervisor: PageSupervisor, said: list[str], flight: RehearsedFlight):
        self.supervisor, self.said, self.flight = supervisor, said, flight

    def link(self, number: int = 0) -> str:
        """Link of one process, once it accepts connections."""
        wait_until(lambda: len(self._links()) > number, "a process of the pages")
        return self._links()[number]

    def _links(self) -> list[str]:
        return re.findall(r"https?://\S+/#\S+", "\n".join(self.said))


@contextmanager
def pages(folder: Path, protocol: Path | None = None, diary: Path | None = None) -> Iterator[Pages]:
    flight, said = RehearsedFlight(), list[str]()
    address = Address(port=0, browser=False)
    with bound(address) as (listening, host):
        trial = TrialRequest(folder, None if protocol is None else str(protocol))
        path = diary or folder / "console.jsonl"

        def job(link: DeskLink) -> PageJob:
            return PageJob(link.names, address, listening, host, path, trial, bytes(32), new_token())

        supervisor, is_over = PageSupervisor(SessionController(flight), job, False, said.append), threading.Event()

        def run() -> None:
            with suppress(ExogravError):
                supervisor.run(is_over)

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield Pages(supervisor, said, flight)
        finally:
            is_over.set()
            thread.join()
            supervisor.end()


@pytest.mark.parametrize("number", [signal.SIGKILL, pytest.param(signal.SIGSTOP, marks=pytest.mark.long)])
def test_pages_of_a_process_that_is_killed_or_stands_still_come_back_with_their_login(
    tmp_path: Path, number: signal.Signals
):
    with pages(tmp_path) as running:
        first = running.link()
        with Page(first) as operator, suppress(ConnectionClosed):
            assert operator.act("make_ready", seen_version=operator.shown["version"])["taken"]
            os.kill(running.supervisor.pid, number)
            running.link(1)
        with Page(first, login=operator.login) as operator:
            assert operator.shown["mode"] in ("self_test", "exo_only")
            assert operator.act("stop")["taken"]
        assert running.flight.moment().latch is not None
    lines = (tmp_path / "console.jsonl").read_text(encoding="utf-8").splitlines()
    assert sum('"line opened"' in line for line in lines) == 2


@pytest.mark.long
def test_a_process_of_the_pages_that_has_no_memory_left_is_replaced(tmp_path: Path):
    with pages(tmp_path) as running:
        link, pid, kind = running.link(), running.supervisor.pid, resource.RLIMIT_AS
        time.sleep(1.0)  # its threads have started: without memory none could
        used = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        resource.prlimit(pid, kind, (used, resource.prlimit(pid, kind)[1]))
        wait_until(lambda: answers(link) and running.supervisor.pid != pid, "pages of another process")
        with Page(running.link(1)) as operator:
            assert operator.act("stop")["taken"]


def answers(link: str) -> bool:
    with suppress(OSError), urllib.request.urlopen(link, timeout=1.0) as page:
        return page.status == 200
    return False


@pytest.mark.long
def test_the_run_of_a_protocol_goes_on_in_the_next_process(tmp_path: Path):
    with pages(tmp_path, short_file(tmp_path, window_s=30.0)) as running:
        with Page(running.link()) as operator, suppress(ConnectionClosed):
            assert operator.run("start")["taken"]
            operator.until(lambda: operator.window == 1)
            os.kill(running.supervisor.pid, signal.SIGKILL)
            running.link(1)
        with Page(running.link(), login=operator.login) as operator:
            assert operator.run_shown["status"] == "paused"
            assert operator.run("resume")["taken"]
            operator.until(lambda: operator.window == 1)


def test_the_process_of_the_pages_has_descriptors_of_its_own(tmp_path: Path):
    with pages(tmp_path) as running:
        running.link()
        limits = Path(f"/proc/{running.supervisor.pid}/limits").read_text(encoding="ascii")
    (line,) = [line for line in limits.splitlines() if line.startswith("Max open files")]
    assert line.split()[3:5] == [str(DESCRIPTORS_MAX)] * 2


@pytest.mark.long
def test_processes_that_end_at_once_are_not_replaced_for_ever(tmp_path: Path):
    with bound(Address(port=0)) as (listening, host):
        trial, said = TrialRequest(tmp_path, None), list[str]()
        (tmp_path / "file").touch()

        def job(link: DeskLink) -> PageJob:
            diary = tmp_path / "file" / "console.jsonl"
            return PageJob(link.names, Address(), listening, host, diary, trial, bytes(32), new_token())

        supervisor = PageSupervisor(SessionController(RehearsedFlight()), job, False, said.append)
        with pytest.raises(ExogravError, match=rf"exit status 1.*as {FRUITLESS_MAX} before it"):
            supervisor.run(threading.Event())
        assert supervisor.end() is None


def test_ctrl_c_ends_the_session_once_however_often_it_comes():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background lets it be ignored
    try:
        with ended_by_ctrl_c() as is_over:
            for _ in range(3):
                signal.raise_signal(signal.SIGINT)
            assert is_over.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
