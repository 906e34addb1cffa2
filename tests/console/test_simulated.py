"""Every page of a simulated machine says so, before and after a login; a page of a real machine never does."""

from pathlib import Path

import pytest

from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.page_files import PAGES
from exograv.console.server import BANNER, MORE_OF_PARTICIPANT

from .client import TestClient, enter
from .fake_desk import FakeDesk

PATHS = ["/", *(f"/{role.value}/" for role in Role), *(f"/participant/{name}" for name in MORE_OF_PARTICIPANT)]
MARK = '<p id="simulated"'


def pages(client: TestClient, hub: Hub) -> dict[str, str]:
    """HTML of every page, by its path."""
    for role in Role:
        enter(client, hub, role)
    answers = {path: client.get(path) for path in PATHS}
    assert {path: answer.status_code for path, answer in answers.items()} == dict.fromkeys(PATHS, 200)
    return {path: answer.text for path, answer in answers.items()}


def test_every_page_of_a_simulated_machine_begins_with_the_banner(client: TestClient, hub: Hub):
    for path, html in pages(client, hub).items():
        body = html[html.index("<body") :]
        assert body[body.index(">") + 1 :].strip().startswith(MARK), path
        assert html.count(MARK) == 1, path


def test_no_page_of_a_real_machine_has_the_banner(client: TestClient, hub: Hub):
    assert isinstance(hub.desk, FakeDesk)
    hub.desk.is_twin = False
    hub.shown = hub.desk.shown()
    assert {path for path, html in pages(client, hub).items() if MARK in html} == set()


def test_all_html_files_are_served_as_pages():
    # `view.html` belongs to `exograv view`, which marks a simulated recording by itself.
    served = {"enter", "console", "participant", "therapist", "view", *MORE_OF_PARTICIPANT}
    assert {path.stem for path in PAGES.glob("*.html") if path.name != BANNER} == served


@pytest.mark.parametrize("path", sorted(PAGES.glob("*.html")), ids=lambda path: path.name)
def test_the_place_of_the_banner_is_found_in_every_page(path: Path):
    assert path.name == BANNER or path.read_text(encoding="utf-8").count("<body") == 1
