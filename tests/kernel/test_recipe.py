"""A function is built once for the same builder, arguments and source; any change of these builds it again."""

import logging
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.kernel import object_code, recipe
from exograv.kernel.content import content_digest

BUILT: list[float] = []


class Side(Enum):
    LEFT = 1
    RIGHT = 2


@dataclass
class Link:
    mass: float
    name: str = "link"
    com: np.ndarray = field(default_factory=lambda: np.zeros(3))


def scaled(link: Link) -> ca.Function:
    BUILT.append(link.mass)
    x = ca.SX.sym("x", 2)
    return ca.Function("scaled", [x], [link.mass * ca.sin(x) + ca.vertcat(*link.com[:2])], ["x"], ["y"])


@pytest.fixture(autouse=True)
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    # A source that was edited a moment ago must not decide whether these tests pass.
    monkeypatch.setattr(recipe, "source_digest", lambda: "source")
    BUILT.clear()


def outputs(link: Link) -> np.ndarray:
    return kernel.compile(kernel.Recipe(scaled, (link,))).of([0.3, 2.0])[0]


def test_the_second_start_builds_no_expression_and_gives_the_same_bits():
    first, plain = outputs(Link(1.5)), kernel.compile(scaled(Link(1.5))).of([0.3, 2.0])[0]
    BUILT.clear()
    assert np.array_equal(outputs(Link(1.5)), first)
    assert np.array_equal(first, plain)
    assert BUILT == []


def test_a_batch_of_a_stored_recipe_gives_the_same_bits():
    states = np.linspace(-2.0, 2.0, 18).reshape(2, 9)
    first = kernel.compile(kernel.Recipe(scaled, (Link(1.5),)), lanes=2).of(states)[0]
    BUILT.clear()
    assert np.array_equal(kernel.compile(kernel.Recipe(scaled, (Link(1.5),)), lanes=2).of(states)[0], first)
    assert BUILT == []


def test_another_argument_gives_another_function():
    other = Link(1.5, com=np.array([0.0, 1e-3, 0.0]))
    assert (outputs(Link(1.5)) == outputs(other)).tolist() == [True, False]
    assert len(BUILT) == 2


def test_a_changed_source_builds_the_function_again(monkeypatch: pytest.MonkeyPatch):
    outputs(Link(1.5))
    monkeypatch.setattr(recipe, "source_digest", lambda: "changed")
    outputs(Link(1.5))
    assert BUILT == [1.5, 1.5]


def test_lost_code_is_compiled_again_from_the_builder(monkeypatch: pytest.MonkeyPatch):
    first = outputs(Link(1.5))
    monkeypatch.setattr(object_code, "compiler_name", lambda: "another compiler")
    monkeypatch.setattr("exograv.kernel.native.compiler_name", lambda: "another compiler")
    assert np.array_equal(outputs(Link(1.5)), first)
    assert BUILT == [1.5, 1.5]


def test_an_argument_of_unknown_content_is_built_at_each_start(caplog: pytest.LogCaptureFixture):
    x = ca.SX.sym("x")
    asked = kernel.Recipe(lambda of: ca.Function("f", [x], [x + of.number]), (type("Odd", (), {"number": 1})(),))
    with caplog.at_level(logging.INFO):
        assert asked.key is None
        assert kernel.compile(asked).of(2.0)[0] == 3.0


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, 1.0),
        (1, True),
        ("1", 1),
        (0.0, -0.0),
        ((1, (2,)), ((1, 2),)),
        (["ab"], ["a", "b"]),
        (np.zeros(2), np.zeros((2, 1))),
        (np.zeros(2), np.zeros(2, np.float32)),
        (Side.LEFT, Side.RIGHT),
        ({"a": 1}, {"a": 2}),
        (Link(1.0), Link(1.0, "other")),
        (Path("a"), "a"),
    ],
)
def test_different_values_have_different_digests(one: object, other: object):
    assert content_digest((one,)) != content_digest((other,))


def test_equal_sets_have_the_same_digest_in_any_order():
    one, other = set([0, 8]), set([8, 0])  # noqa: C405 - the order of insertion matters
    assert list(one) != list(other), "this interpreter has another order of sets"
    assert content_digest((one, Link(2.0))) == content_digest((other, Link(2.0)))


def test_the_digest_of_a_record_ignores_what_it_has_cached():
    cached = Link(2.0)
    cached.__dict__["drawn"] = object()
    assert content_digest((cached,)) == content_digest((Link(2.0),))


def test_a_source_that_changed_after_its_import_is_never_the_key_of_an_outline(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.undo()
    monkeypatch.setattr(recipe, "IMPORTED_S", 0.0)
    assert recipe.source_digest.__wrapped__() is None
    monkeypatch.setattr(recipe, "IMPORTED_S", float("inf"))
    assert recipe.source_digest.__wrapped__() is not None


def test_without_a_digest_of_the_source_nothing_is_stored(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(recipe, "source_digest", lambda: None)
    outputs(Link(1.5))
    outputs(Link(1.5))
    assert BUILT == [1.5, 1.5]
