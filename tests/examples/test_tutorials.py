"""Every command of the tutorials and of the start pages exists and takes its options."""

import re
import shlex
from pathlib import Path

import pytest
import tyro

from exograv.cli import ACTIONS
from exograv.cli.shell.command import command_class, option_classes

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [*sorted((DOCS / "tutorials").glob("*.md")), *sorted((DOCS / "start").glob("*.md"))]


def commands_in(text: str) -> list[str]:
    """Commands of a page: indented lines, and code within a sentence."""
    return re.findall(r"^ +exograv (.+)$|`exograv ([^`…]+)`", text, flags=re.MULTILINE)


COMMANDS = [
    pytest.param(block or inline, id=f"{page.stem}: {block or inline}")
    for page in PAGES
    for block, inline in commands_in(page.read_text(encoding="utf-8"))
]


def parsed(command: str):
    """Return the action of a command and its options, without running it."""
    words = shlex.split(command)
    name = next(" ".join(words[:n]) for n in (2, 1) if " ".join(words[:n]) in ACTIONS)
    options = tyro.cli(
        command_class(ACTIONS[name]),
        args=words[len(name.split()) :],
        config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.SuppressFixed),
    )
    return ACTIONS[name], options


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_pages_is_accepted(command: str):
    action, options = parsed(command)
    for kind in option_classes(action).values():
        names = [name for name in kind.__dataclass_fields__ if kind.__dataclass_fields__[name].init]
        kind(**{name: getattr(options, name) for name in names})


def test_each_tutorial_has_commands():
    for page in sorted((DOCS / "tutorials").glob("*.md")):
        assert len(commands_in(page.read_text(encoding="utf-8"))) >= 5, page.name
