"""A Chromium, if there is one; with EXOGRAV_BROWSER_TESTS=required there has to be."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright
from tests.console.serving import Served, served

from exograv.console import lease
from exograv.console.keys import Role

from .of_browser import Visitor, quick_plan

CHROMIUM = Path("/usr/bin/chromium")
# Without a sandbox in tests only; a graphics card is nothing that a test may need.
ARGUMENTS = ["--no-sandbox", "--disable-gpu"]

Visit = Callable[..., Visitor]


# Not for the whole run: while it is there this thread has a loop, and no test after these could have one of its own.
@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if not CHROMIUM.exists() and os.environ.get("EXOGRAV_BROWSER_TESTS") != "required":
        pytest.skip(f"There is no {CHROMIUM}. On Debian: apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    """A server on a fake desk, with a protocol of seconds."""
    # A busy computer may hold a browser for seconds; what a lease does is tested in tests/console.
    monkeypatch.setattr(lease, "LEASE_S", 8.0)
    with served(tmp_path, quick_plan()) as running:
        yield running


@pytest.fixture
def visit(browser: Browser, house: Served) -> Iterator[Visit]:
    """Lets somebody in, and sees to it that all go in peace."""
    visitors = list[Visitor]()

    def come(role: Role, language: str = "en", **size: int) -> Visitor:
        visitors.append(Visitor(browser, house, role, language, **size))
        return visitors[-1]

    yield come
    for visitor in visitors:
        visitor.close()
    assert house.hub.failure is None
