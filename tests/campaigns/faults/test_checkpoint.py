"""A verdict that is read from its file equals the one that was written."""

from pathlib import Path

import pytest

from exograv.campaigns.faults.checkpoint import FILE, KeptVerdicts
from exograv.campaigns.faults.evaluation import figures_of
from exograv.campaigns.faults.scenario import Scenario, ScenarioVerdict
from exograv.campaigns.faults.scenario_log import ScenarioLog
from exograv.errors import RecordingError
from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

CAMPAIGN = {"seed": 3, "level": 2}


def verdicts() -> list[ScenarioVerdict]:
    stopped = ScenarioLog(
        ticks=1800,
        violations=["tick 3: a step"],
        violated_ticks=1,
        stopped_tick=420,
        reason=StopReason.TOO_FAST,
        since={SafeState.DESCENT: 420, SafeState.ISOLATION: 424},
        hand_m_s=0.3,
    )
    one = ScenarioVerdict(Scenario(3, 0, ("F01",)), stopped, False, {"F01": 3.0}, ("F01",), 0.4, True)
    pair = ScenarioVerdict(
        Scenario(3, 1, ("F02", "F29"), " --level 3"), ScenarioLog(crashed="no"), True, {"F02": None}, (), 0.3, False
    )
    return [one, pair]


def test_what_comes_back_from_the_file_is_what_was_kept(tmp_path: Path):
    KeptVerdicts(tmp_path, CAMPAIGN, resume=False).add(verdicts())
    again = list(KeptVerdicts(tmp_path, CAMPAIGN, resume=True).verdicts.values())
    assert again == verdicts()
    assert figures_of(again) == figures_of(verdicts())


def test_another_campaign_does_not_go_on_with_it(tmp_path: Path):
    KeptVerdicts(tmp_path, CAMPAIGN, resume=False).add(verdicts())
    with pytest.raises(RecordingError, match="seed 4"):
        KeptVerdicts(tmp_path, {**CAMPAIGN, "seed": 4}, resume=True)


def test_rows_that_are_no_verdicts_are_refused(tmp_path: Path):
    KeptVerdicts(tmp_path, CAMPAIGN, resume=False)
    with (tmp_path / FILE).open("a") as file:
        file.write('{"scenario": {"number": 1}, "course": {}}\n')
    with pytest.raises(RecordingError, match="damaged"):
        KeptVerdicts(tmp_path, CAMPAIGN, resume=True)
