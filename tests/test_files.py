"""A file is written completely or not at all, and TOML reads back as it was written."""

import math
import os
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import RecordingError
from exograv.files import replace_file, toml_text, toml_value, write_whole

VALUES = st.recursive(
    st.booleans() | st.integers(-(2**62), 2**62) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(min_size=1, max_size=8), inner, max_size=3),
    max_leaves=8,
)


def _disk_is_full(path: Path) -> None:
    path.write_text("half")
    raise OSError(28, "No space left on device")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path):
    path = tmp_path / "kept.toml"
    write_whole(path, "old")
    with pytest.raises(RecordingError, match=r"kept\.toml cannot be written"):
        write_whole(path, _disk_is_full)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["kept.toml"]


@pytest.mark.parametrize("error", [KeyboardInterrupt(), ValueError("no figure")])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, error: BaseException):
    path = tmp_path / "file.txt"
    path.write_text("old")

    def half(partial: Path) -> None:
        partial.write_text("ha")
        raise error

    with pytest.raises(type(error)):
        replace_file(path, half)
    assert {one.name: one.read_text() for one in tmp_path.iterdir()} == {"file.txt": "old"}


def test_a_private_file_is_read_by_its_owner_only(tmp_path: Path):
    replace_file(tmp_path / "private", b"x", is_private=True)
    assert (tmp_path / "private").stat().st_mode & 0o077 == 0


def test_an_unfinished_file_is_found_by_no_suffix(tmp_path: Path):
    found = list[Path]()
    replace_file(tmp_path / "one.toml", lambda partial: (partial.touch(), found.extend(tmp_path.glob("*.toml")))[0])
    assert found == []


@given(content=st.dictionaries(st.text(min_size=1, max_size=8), VALUES, max_size=5))
def test_toml_reads_back_as_it_was_written(content: dict[str, object]):
    assert tomllib.loads(toml_text(content, "# head\n")) == content


@given(value=st.text() | st.lists(st.floats(allow_nan=False)))
def test_a_single_value_reads_back_as_it_was_written(value: object):
    assert tomllib.loads(f"x = {toml_value(value)}")["x"] == value


def test_a_value_that_is_not_a_number_is_written_as_toml_writes_it():
    assert math.isnan(tomllib.loads(toml_text({"x": math.nan}))["x"])
