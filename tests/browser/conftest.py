"""Fixtures with Chromium. Without it the tests are skipped, or fail with EXOGRAV_BROWSER_TESTS=required."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright
from tests.console.serving import Served, served

from exograv.console import lease
from exograv.console.keys import Role

from .of_browser import Visitor, quick_plan

CHROMIUM = Path("/usr/bin/chromium")
# The sandbox is off in tests only. Tests must not need a graphics card.
ARGUMENTS = ["--no-sandbox", "--disable-gpu"]
WITHOUT_3D = [*ARGUMENTS, "--disable-3d-apis"]
"""Arguments for all tests but those of test_view3d.py. Where the processor draws the person in 3D (SwiftShader), each
picture takes both cores of a small computer from the server and all pages, which no browser with a graphics card does.
That plots keep their rate beside the pictures, even then, is tested there."""

Visit = Callable[..., Visitor]


# Module scope: while the browser lives, this thread has an event loop, and later tests could not start their own.
@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium without WebGL: pages show a sentence in place of the person in 3D."""
    with chromium(WITHOUT_3D) as browser:
        yield browser


@contextmanager
def chromium(arguments: list[str]) -> Iterator[Browser]:
    """Start Chromium, or skip the tests where it is missing."""
    if not CHROMIUM.exists() and os.environ.get("EXOGRAV_BROWSER_TESTS") != "required":
        pytest.skip(f"There is no {CHROMIUM}. On Debian: apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield browser
        browser.close()


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    """Server on a fake desk, with a protocol of a few seconds."""
    # A busy computer may delay a browser for seconds. The lease itself is tested in tests/console.
    monkeypatch.setattr(lease, "LEASE_S", 8.0)
    with served(tmp_path, quick_plan()) as running:
        yield running


@pytest.fixture
def visit(browser: Browser, house: Served) -> Iterator[Visit]:
    """Log visitors in. At the end all visitors close, and the console must not have failed."""
    visitors = list[Visitor]()

    def come(role: Role, language: str = "en", **size: int) -> Visitor:
        visitors.append(Visitor(browser, house, role, language, **size))
        return visitors[-1]

    yield come
    for visitor in visitors:
        visitor.close()
    assert house.hub.failure is None
