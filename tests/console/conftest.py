"""Console on a fake desk with a clock that a test sets."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.task.of_run import short_plan

from exograv.console.hub import Hub
from exograv.console.server import application

from .client import HOST, ORIGIN, TestClient
from .fake_desk import FakeDesk
from .of_clock import SetClock
from .serving import hub_on


@pytest.fixture
def clock() -> SetClock:
    return SetClock()


@pytest.fixture
def desk(clock: SetClock) -> FakeDesk:
    return FakeDesk(clock)


@pytest.fixture
def house(desk: FakeDesk, tmp_path: Path) -> Iterator[Hub]:
    """Console with a protocol of three windows, on an active machine."""
    with hub_on(desk, tmp_path, short_plan(screen=None)) as hub:
        yield hub


@pytest.fixture
def hub(tmp_path: Path) -> Iterator[Hub]:
    with hub_on(FakeDesk(), tmp_path, None) as hub:
        yield hub


@pytest.fixture
def client(hub: Hub) -> Iterator[TestClient]:
    with TestClient(application(hub, "http", [HOST, "localhost:8088"]), base_url=ORIGIN) as client:
        yield client
