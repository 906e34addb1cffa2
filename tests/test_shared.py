"""A shared preparation is made once, never used after a change of the source, and never used half."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FunctionType

import pytest
from tests import shared
from tests.shared import prepared


@pytest.fixture
def made() -> list[Path]:
    """Folders that were prepared, in their order."""
    return []


@pytest.fixture
def prepare(made: list[Path]) -> FunctionType:
    def prepares(folder: Path) -> None:
        made.append(folder)
        (folder / "result").write_text(str(len(made)), encoding="utf-8")

    return prepares


def test_it_is_made_once_for_all_who_ask_at_the_same_time(tmp_path: Path, prepare: FunctionType, made: list[Path]):
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: prepared(tmp_path, ("demo",), prepare, lambda: "1"), range(8)))
    assert len(made) == 1
    assert {(folder / "result").read_text(encoding="utf-8") for folder in found} == {"1"}


def test_another_source_or_another_option_is_prepared_anew(tmp_path: Path, prepare: FunctionType, made: list[Path]):
    first = prepared(tmp_path, ("demo", "--seed", "1"), prepare, lambda: "1")
    assert prepared(tmp_path, ("demo", "--seed", "1"), prepare, lambda: "2") != first
    assert prepared(tmp_path, ("demo", "--seed", "2"), prepare, lambda: "1") != first
    assert len(made) == 3


def test_a_preparation_that_failed_is_made_again_from_an_empty_folder(tmp_path: Path, prepare: FunctionType):
    def fails(folder: Path) -> None:
        (folder / "half").write_text("", encoding="utf-8")
        raise ValueError("no more")

    with pytest.raises(ValueError, match="no more"):
        prepared(tmp_path, ("demo",), fails, lambda: "1")
    assert not (prepared(tmp_path, ("demo",), prepare, lambda: "1") / "half").exists()


def test_a_source_that_changes_meanwhile_leaves_nothing_for_a_later_run(
    tmp_path: Path, prepare: FunctionType, made: list[Path]
):
    source = iter("1212")
    prepared(tmp_path, ("demo",), prepare, lambda: next(source))
    prepared(tmp_path, ("demo",), prepare, lambda: "1")
    assert len(made) == 2


def test_the_hash_follows_every_file_of_the_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "src").mkdir()
    monkeypatch.setattr(shared, "ROOT", tmp_path)
    monkeypatch.setattr(shared, "SOURCES", ("src",))
    found = {shared.source_hash()}
    for name, text in (("a.py", "1"), ("a.py", "2"), ("b.toml", "2")):
        (tmp_path / "src" / name).write_text(text, encoding="utf-8")
        found.add(shared.source_hash())
    (tmp_path / "src" / "a.py").rename(tmp_path / "src" / "c.py")
    found.add(shared.source_hash())
    assert len(found) == 5


def test_every_source_that_is_hashed_exists():
    assert all((shared.ROOT / source).exists() for source in shared.SOURCES)
