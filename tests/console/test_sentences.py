"""Every sentence of the server has its code and fields, from whichever room it comes."""

import ast
import pickle
import re
from pathlib import Path

import pytest

from exograv.console import hub
from exograv.console.sentences import SENTENCES, say, spoken
from exograv.experiment.steered import session_controller as desk
from exograv.identification.core.interface import Outcome
from exograv.runtime.control_loop import steering
from exograv.safety.modes import Event, Mode
from exograv.safety.stops import StopReason

GAP = re.compile(r"\{(\w+)\}")
IN_CONSOLE = ("handlers", "hub", "broadcaster", "trial", "feed", "line")
IN_SESSION = ("request_validation", "session_controller", "live_session", "participant_keeping", "rehearsal")
"""Modules that send sentences to pages."""


@pytest.mark.parametrize("code", SENTENCES)
def test_each_has_its_code_and_gaps_in_another_process_too(code: str):
    text = SENTENCES[code]
    others = {"latch": StopReason.TOO_FAST.sentence, "mode": StopReason.TOO_FAST.sentence}
    filled = {name: others.get(name, f"x-{name}") for name in GAP.findall(text)}
    said = spoken(pickle.loads(pickle.dumps(say(code, **filled))))
    assert said["code"] == code
    assert said["text"] == text.format(**filled)
    assert {name: gap["text"] for name, gap in said["gaps"].items()} == filled
    assert all(gap["code"] == "stop.too_fast" for name, gap in said["gaps"].items() if name in others)


@pytest.mark.parametrize("said", [*Mode, *StopReason, *Outcome])
def test_what_comes_from_below_is_recognised(said: Mode | StopReason | Outcome):
    assert spoken(said.sentence)["code"].endswith(f".{said.name.lower()}")
    assert SENTENCES[said.sentence.code] == said.value


def test_a_guard_and_a_desk_that_say_the_same_say_it_in_one_sentence():
    refused = steering.CommandDecisions()
    refused.lease(steering.LeaseCommand(until_ns=10**9), now_ns=0)
    assert spoken(refused.ask(Event.TAKE_ARM, Mode.MOVING, is_latched=False, now_ns=0)) == {
        "text": f"Not possible now. {Mode.MOVING.value}",
        "code": "desk.not_possible",
        "gaps": {"mode": {"text": Mode.MOVING.value, "code": "mode.moving", "gaps": {}}},
    }


def test_what_a_file_or_a_system_says_stays_as_it_is():
    text = "out/x.toml is damaged: line 3."
    assert spoken(text) == {"text": text, "code": "", "gaps": {}}


def literals(path: Path) -> list[str]:
    """Sentences in a module outside docstrings and exceptions."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = [node for node in ast.walk(tree) if isinstance(node, (ast.Raise, ast.Expr)) and not _calls(node)]
    inside = {id(each) for node in skipped for each in ast.walk(node)}
    constants = (each for each in ast.walk(tree) if isinstance(each, ast.Constant) and id(each) not in inside)
    return [each.value for each in constants if isinstance(each.value, str) and _is_sentence(each.value)]


def _calls(node: ast.Raise | ast.Expr) -> bool:
    return isinstance(node, ast.Expr) and not isinstance(node.value, ast.Constant)


def _is_sentence(text: str) -> bool:
    return text[:1].isupper() and text.endswith(".") and " " in text


def test_nothing_is_said_to_a_page_past_the_table():
    places = ((hub, IN_CONSOLE), (desk, IN_SESSION))
    modules = [Path(each.__file__ or "").with_name(f"{name}.py") for each, names in places for name in names]
    assert {path.name: found for path in modules if (found := literals(path))} == {}
