"""The file of identities opens with the passphrase only."""

import os
import stat
from pathlib import Path

import pytest

from exograv.errors import ConfigError, RecordingError
from exograv.study.participants.identities import read_identities, write_identities

PASSPHRASE = "a long enough passphrase"
CHEAP = 2**10
"""Cost of scrypt; a test need not withstand an attack."""

WHO = {"K9RR9PR": {"name": "Jörg Müller-Lüdenscheidt", "contact": "+49 170 1234567"}}


def written(path: Path) -> Path:
    write_identities(path, PASSPHRASE, WHO, CHEAP)
    return path


def test_what_was_written_comes_back_and_nothing_of_it_is_readable(tmp_path: Path):
    path = written(tmp_path / "study.identities")
    assert read_identities(path, PASSPHRASE) == WHO
    content = path.read_bytes()
    assert not any(part.encode() in content for part in ("Müller", "1234567", "K9RR9PR"))
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_guess_at_the_passphrase_of_a_users_file_takes_128_MB(tmp_path: Path):
    path = tmp_path / "study.identities"
    write_identities(path, PASSPHRASE, WHO)
    assert b'"n":131072,"r":8' in path.read_bytes()
    assert read_identities(path, PASSPHRASE) == WHO


def test_a_wrong_passphrase_is_one_sentence_and_alters_nothing(tmp_path: Path):
    path = written(tmp_path / "study.identities")
    before = path.read_bytes()
    with pytest.raises(ConfigError, match="the passphrase is wrong") as refused:
        read_identities(path, "another passphrase")
    assert "\n" not in str(refused.value)
    assert path.read_bytes() == before


@pytest.mark.parametrize("place", [30, 120, -1, -4000])
def test_a_changed_byte_anywhere_is_noticed(tmp_path: Path, place: int):
    path = written(tmp_path / "study.identities")
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)
    with pytest.raises(ConfigError):
        read_identities(path, PASSPHRASE)


def test_a_header_that_asks_for_all_memory_is_refused(tmp_path: Path):
    path = written(tmp_path / "study.identities")
    path.write_bytes(path.read_bytes().replace(b'"n":1024', b'"n":1099511627776'))
    with pytest.raises(ConfigError, match="damaged in its first lines"):
        read_identities(path, PASSPHRASE)


def test_the_same_identities_never_look_the_same_and_their_length_tells_little(tmp_path: Path):
    one, other = written(tmp_path / "one"), written(tmp_path / "other")
    write_identities(tmp_path / "more", PASSPHRASE, {**WHO, "R7RX4L7": {"name": "Wu"}}, CHEAP)
    assert one.read_bytes() != other.read_bytes()
    assert one.stat().st_size == (tmp_path / "more").stat().st_size


def test_a_short_passphrase_is_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match="at least 12 are required"):
        write_identities(tmp_path / "x", "short", WHO, CHEAP)
    assert not (tmp_path / "x").exists()


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = written(tmp_path / "study.identities")

    def full(_handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RecordingError, match="No space left"):
        write_identities(path, PASSPHRASE, {}, CHEAP)
    assert read_identities(path, PASSPHRASE) == WHO
    assert list(tmp_path.iterdir()) == [path]
