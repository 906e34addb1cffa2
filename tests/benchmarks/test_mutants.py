"""The table of equivalent mutants is in force, and the runner finds wrong changes of the guard."""

import ast
from pathlib import Path

from guard_mutants import ROOMS, Equivalent, Mutant, equivalents, find_equivalents, mutants
from mutant_log import Log, digests_of
from mutant_runs import Order
from wrong_lines import changes, visited


def one_of(source: str, change: str, function: str) -> Mutant:
    path = Path("example.py")
    [found] = [
        Mutant(path, source, what, i, j, function)
        for i, node in enumerate(visited(ast.parse(source)))
        for j, (what, _) in enumerate(changes(node))
        if what == change
    ]
    return found


SOURCE = "import math\n\n\ndef least(a, b):\n    return b if b < a else a\n\n\ndef half(a):\n    return 0.5 * a\n"


def test_a_mutant_states_the_line_before_and_after_its_change():
    assert one_of(SOURCE, "Mult to Div", "half").lines() == ("return 0.5 * a", "return 0.5 / a")
    assert "0.5 / a" in ast.unparse(one_of(SOURCE, "Mult to Div", "half").tree())


def test_each_change_in_the_table_of_equivalent_mutants_is_a_mutant_and_has_a_reason():
    rows = equivalents()
    equivalent, wrong = find_equivalents([one for room in ROOMS.values() for one in mutants(room)], rows)
    assert wrong == []
    assert len(equivalent) == sum(row.places * len(row.becomes) for row in rows)
    assert all(row.reason.endswith(".") for row in rows)


def test_a_change_that_is_no_mutant_is_not_equivalent():
    row = Equivalent("example.py", "half", "return 0.5 * a", ("return 0.5 / a", "return 2 * a"), "A reason.")
    equivalent, wrong = find_equivalents([one_of(SOURCE, "Mult to Div", "half")], [row])
    assert len(equivalent) == 1
    assert wrong == ["0 mutants: example.py | half | return 0.5 * a | return 2 * a"]


def test_a_killed_mutant_stays_killed_until_the_test_that_killed_it_changes(tmp_path: Path):
    killer, room = "test_guard.py::test_a_guard_that_has_seen_nothing_is_not_reset", ROOMS["safety"]
    log = Log(tmp_path / "log.jsonl", room)
    log.note("a", "one", (1, f"tests/safety/{killer}[1]", {}))
    log.note("b", "two", (0, "", {}))
    later = Log(tmp_path / "log.jsonl", room)
    assert (later.result("a"), later.result("b"), later.result("c")) == (True, False, None)
    later.tests = "other tests"
    assert (later.result("a"), later.result("b")) == (True, None)
    later.digests[killer] = "another test"
    assert later.result("a") is None


def test_a_kill_counts_less_with_each_later_one():
    order = Order({"quick": 0.1, "slow": 5.0})
    for _ in range(3):
        order.note("slow")
    assert order.kills["slow"] == 1.0 + 0.9 + 0.81
    assert order.kills["quick"] == 0.0


def test_a_test_counts_as_changed_with_its_helpers_and_not_with_other_tests(tmp_path: Path):
    helper, file = tmp_path / "bench.py", tmp_path / "test_it.py"
    helper.write_text("SIZE = 1\n")
    file.write_text("from .bench import SIZE\n\ndef test_one(): pass\n")
    before = digests_of([helper, file])
    file.write_text(file.read_text() + "\ndef test_two(): pass\n")
    assert digests_of([helper, file])["test_it.py::test_one"] == before["test_it.py::test_one"]
    helper.write_text("SIZE = 2\n")
    assert digests_of([helper, file])["test_it.py::test_one"] != before["test_it.py::test_one"]
