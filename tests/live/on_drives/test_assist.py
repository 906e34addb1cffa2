"""Sessions in the twin, on simulated drives and on a real machine are never mixed in one file."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.live.on_drives.assist import kept_on_drives
from exograv.live.on_drives.support_level import live_options
from exograv.options import OptionRecord
from exograv.procedures.rehabilitation.assist.options import AssistOptions
from exograv.procedures.rehabilitation.assist.participant_record import ASSIST_FILE, AssistFile, read_assist
from exograv.procedures.rehabilitation.support_level.options import SupportOptions

DRIVES = Path("drives.toml")
TWIN = AssistOptions(participant="P-07")
SIMULATED = AssistOptions(participant="P-07", simulate=True)
REAL = AssistOptions(participant="P-07", drives=DRIVES)
KEPT = {"twin": TWIN.kept, "simulated": kept_on_drives(SIMULATED), "real": kept_on_drives(REAL)}


@pytest.mark.parametrize("first", KEPT)
@pytest.mark.parametrize("then", KEPT)
def test_a_file_is_continued_only_where_it_was_begun(first: str, then: str, tmp_path: Path):
    path = tmp_path / "assist_P-07.json"
    ASSIST_FILE.write(path, AssistFile(participant="P-07", options=KEPT[first]))

    def read(kept: OptionRecord) -> AssistFile:
        return read_assist(path, "P-07", kept)

    if first == then:
        assert read(KEPT[then]).options == KEPT[first]
        return
    with pytest.raises(ConfigError, match="were flown with"):
        read(KEPT[then])


def test_a_simulated_person_grows_stronger_and_a_real_machine_has_none():
    first, second = (SIMULATED.person(number).simulation for number in (1, 2))
    assert first == ("--worn", "--person", "weak", "--strength", "0.1")
    assert float(second[-1]) > 0.1
    assert "strength" not in KEPT["real"]


@pytest.mark.parametrize("options", [SupportOptions(drives=DRIVES), REAL])
def test_the_live_run_has_the_machine_of_the_command(options: SupportOptions | AssistOptions):
    live = live_options(options, 20.0, 100.0)
    assert (live.rig, live.drives, live.identify_s, live.seconds) == (options.rig, DRIVES, 20.0, 100.0)


def test_a_virtual_person_who_plans_in_the_drives_refuses_real_time():
    with pytest.raises(ConfigError, match="--real-time is given"):
        SupportOptions(simulate=True, real_time=True)
