"""A result replaces only a file of its own kind."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.storage.calibration_file import refuse_other_than_calibration
from exograv.storage.participant_file import HEAD as PARTICIPANT_HEAD
from exograv.storage.participant_file import refuse_other_than_participant

OTHER_KINDS = {
    "a machine's settings": 'name = "my_machine"\n\n[urdf]\nright = "right.urdf"\n',
    "a participant's file": f'{PARTICIPANT_HEAD}schema_version = 1\ncontent_sha256 = "0"\n\n[person]\ncode = "P-07"\n',
    "a table": "t,q\n0,1\n",
    "bytes": "\x00\x01",
}
SAME_KIND = {
    "an empty file": "",
    "a file whose values were cut off": "# Calibration of an empty machine, written by",
    "a file without its comment": 'schema_version = 1\ncontent_sha256 = "0"\n',
}


@pytest.mark.parametrize("name", OTHER_KINDS)
def test_a_calibration_does_not_replace_a_file_of_another_kind(name: str, tmp_path: Path):
    file = tmp_path / "file"
    file.write_text(OTHER_KINDS[name], encoding="utf-8")
    with pytest.raises(ConfigError, match="Give another path with --calibration or --out"):
        refuse_other_than_calibration(file)


@pytest.mark.parametrize("name", SAME_KIND)
def test_a_damaged_calibration_may_be_measured_again(name: str, tmp_path: Path):
    file = tmp_path / "file"
    file.write_text(SAME_KIND[name], encoding="utf-8")
    refuse_other_than_calibration(file)


def test_a_result_does_not_replace_a_folder_and_needs_no_earlier_file(tmp_path: Path):
    refuse_other_than_participant(tmp_path / "new.toml")
    with pytest.raises(ConfigError, match="is of another kind"):
        refuse_other_than_participant(tmp_path)
