"""The shipped protocol of assist-as-needed has the rule's defaults. A file without a valid rule is rejected."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.task.assist_as_needed import AssistSettings
from exograv.task.assist_protocol import FOLDER, load_assist_protocol

SHIPPED = (FOLDER / "assist-as-needed.toml").read_text(encoding="utf-8")


def test_the_shipped_file_says_what_the_rule_is_by_itself():
    loaded = load_assist_protocol("assist-as-needed")
    assert loaded.settings.rule == AssistSettings()
    assert isinstance(loaded.settings.rule.block, int)


def test_a_name_that_is_nearly_right_is_answered_with_the_right_one():
    with pytest.raises(ConfigError, match="Did you mean 'assist-as-needed'"):
        load_assist_protocol("assist-as-neded")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("blocks = 6", "blocks = 0"), "blocks"),
        (("least_percent", "lest_percent"), "support has lest_percent; known: least_percent"),
        (("step_up_percent = 10.0", "step_up_percent = 2.0"), "would not get back the support that was enough"),
        (("block = 12", "block = 4.5"), "support.block is 4.5; give a whole number"),
        (("block = 12", "block = 2"), "A decision needs enough attempts"),
        (("schema_version = 1", "schema_version = 2"), "schema_version"),
        (("raise_share = 0.6", 'raise_share = "some"'), "support.raise_share"),
    ],
)
def test_files_that_state_no_rule_are_refused_by_name(tmp_path: Path, change: tuple[str, str], message: str):
    path = tmp_path / "own.toml"
    path.write_text(SHIPPED.replace(*change, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=message):
        load_assist_protocol(str(path))
