"""The compiled guard is the source that a person reads: same text, same decisions, same state to the last bit."""

import ast
import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest

from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.native import build, core, library, to_c
from exograv.safety.plausible import Features, LimbTable, PlausibleTable
from exograv.safety.record import GuardRecord

from .random_machines import draw_history, draw_machines, first_guards

MACHINES, TICKS, SEEDS = 6, 500, range(4)
"""Machines and ticks of each history. `benchmarks/guard_equality.py` runs millions."""

needs_compiler = pytest.mark.skipif(build.compiler() is None, reason="needs a C compiler")


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    path = tmp_path_factory.mktemp("guard") / build.COMPILED_NAME
    assert build.build(path)
    loaded = library.load(path)
    assert loaded is not None
    return loaded


def test_the_c_text_is_the_translation_of_the_source():
    assert to_c.TARGET.read_text(encoding="utf-8") == to_c.translated(to_c.SOURCE.read_text(encoding="utf-8"))


def test_the_guard_s_source_imports_only_math_and_a_type_and_has_at_most_600_lines_of_code():
    text = to_c.SOURCE.read_text(encoding="utf-8")
    imports = [ast.unparse(node) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert imports == ["import math", "from collections.abc import MutableSequence"]
    documented = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    code = [line for number, line in enumerate(text.splitlines(), start=1) if line.strip() and number not in documented]
    assert len([line for line in code if not line.strip().startswith("#")]) <= 600


@needs_compiler
@pytest.mark.parametrize("seed", SEEDS)
def test_the_compiled_guard_and_its_source_keep_the_same_record_to_the_last_bit(seed: int, compiled: ctypes.CDLL):
    rng = np.random.default_rng(seed)
    machines = draw_machines(rng, MACHINES, (2, 4)[seed % 2])
    with np.errstate(all="ignore"):
        history = draw_history(rng, machines, TICKS)
        hashes = np.zeros((2, MACHINES, core.SIZE), dtype=np.int64)
        for each, into in zip((compiled, None), hashes, strict=True):
            first_guards(machines, history, each, into)
    np.testing.assert_array_equal(hashes[0], hashes[1])


@needs_compiler
@pytest.mark.parametrize(("joints", "most", "further"), [(7, 2, 4), (9, 2, 4), (9, 1, 3), (10, 1, 2), (7, 4, 0)])
def test_the_compiled_guard_and_its_source_carry_limbs_of_many_joints_alike_to_the_last_bit(
    joints: int, most: int, further: int, compiled: ctypes.CDLL
):
    rng = np.random.default_rng(joints)
    numbers = Features(joints, most).count, Features(joints, further, most + 1).count
    rows, potential = rng.normal(size=(2, joints, numbers[0])), rng.normal(size=(2, numbers[1]))
    chain = LimbTable(tuple(rng.permutation(joints).tolist()), most, rows[0], rows[1], further, potential)
    table = PlausibleTable((chain,), *[np.ones(joints)] * 3)
    found = []
    for each in (compiled, None):
        record, packed = GuardRecord(joints, 1e-3, each), table.packed()
        for k, level in enumerate((0.0, 0.0, 1.8)):
            record.put(core.Q, 0.3 * np.arange(joints) - k)
            record.carried(packed, level)
            found.append((record.numbers.tobytes(), np.nan_to_num(packed).tobytes()))
    assert found[:3] == found[3:]


@pytest.mark.parametrize(
    "body",
    ["while True:\n        pass", "x = [1.0]", "raise ValueError", "x = r[0] ** 2.0", "print(r[0])", "x = r[0] and 1"],
)
def test_python_that_has_no_counterpart_in_c_is_not_translated(body: str):
    with pytest.raises(to_c.UntranslatableError, match="has no translation"):
        to_c.translated(f'def f(r: Record) -> None:\n    """Do it."""\n    {body}\n')


def test_without_a_compiler_nothing_is_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    assert not build.build(tmp_path / "guard.so")
    assert library.load(tmp_path / "guard.so") is None


@needs_compiler
def test_a_library_that_was_made_from_another_source_is_not_used(tmp_path: Path):
    source = to_c.SOURCE.read_text(encoding="utf-8")
    other = tmp_path / "core.c"
    other.write_text(to_c.translated(source.replace("SHARE_MAX, MARGIN_NM = 1.3", "SHARE_MAX, MARGIN_NM = 1.4")))
    assert build.build(tmp_path / "guard.so", [other])
    assert library.load(tmp_path / "guard.so") is None


def test_without_the_compiled_guard_the_source_runs():
    envelope = Envelope(Limits(np.array([5.0]), np.array([1.0])), 1e-3, library=None)
    assert envelope.limit(np.array([100.0]), np.zeros(1), np.zeros(1)) == pytest.approx([0.15])
