"""The reference of settings files has every key that the classes accept, with its limits, default and meaning."""

import re
from types import ModuleType

import pytest
from tests.docs_scripts import docs_script

from exograv.model.rig_settings import Cuff, JointSweep, RigSettings
from exograv.rig.drives.settings import Drive, DrivesSettings
from exograv.task.assist_as_needed import AssistSettings
from exograv.task.protocol_schema import Protocol


@pytest.fixture(scope="module")
def pages() -> ModuleType:
    """Module of the script, which is not part of the package."""
    return docs_script("settings_pages")


def row_of(table: str, key: str) -> list[str]:
    """Cells of a key after its name."""
    found = re.search(rf"^\| `{key}` \| (.*) \|$", table, flags=re.MULTILINE)
    assert found is not None
    return [cell.strip() for cell in found[1].split(" | ")]


def test_a_table_within_a_list_within_a_table_is_found_with_its_path(pages: ModuleType):
    tables = pages.tables_of({RigSettings: ""})
    assert tables[Cuff] == "cuffs"
    assert tables[JointSweep] == "calibration.sweeps"


def test_every_key_of_every_table_has_a_row(pages: ModuleType):
    for content in (RigSettings, DrivesSettings, Protocol):
        for kind in pages.tables_of({content: ""}):
            for key in kind.model_fields:
                row_of(pages.table_of(kind), key)


def test_a_row_states_type_limits_default_and_meaning(pages: ModuleType):
    watchdog = row_of(pages.table_of(DrivesSettings), "watchdog_ms")
    assert watchdog[:2] == ["number, ≥ 5, ≤ 30", "`20.0`"]
    assert watchdog[2].startswith("Time without a command")


def test_a_required_key_has_no_default_and_one_that_may_be_absent_has_a_dash(pages: ModuleType):
    table = pages.table_of(Drive)
    assert row_of(table, "node")[1] == ""
    assert row_of(table, "counts_per_turn")[1] == "–"


def test_a_plain_dataclass_has_its_defaults_and_meanings(pages: ModuleType):
    assert row_of(pages.table_of(AssistSettings), "block") == ["integer", "`12`", "Attempts before a decision."]


def test_a_table_without_a_meaning_of_its_own_has_that_of_its_class(pages: ModuleType):
    assert row_of(pages.table_of(RigSettings), "donning")[2] == "Posture in which the cuffs are fastened."
