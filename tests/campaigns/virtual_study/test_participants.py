"""The right sessions are recorded for the study, each with the right number of windows."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from exograv.campaigns.virtual_study import participants as people
from exograv.campaigns.virtual_study.careers import careers
from exograv.campaigns.virtual_study.options import StudyOptions
from exograv.campaigns.virtual_study.participants import ParticipantSimulation
from exograv.errors import IdentificationError

CODES = ("VA", "VB")


class Told(ParticipantSimulation):
    """Simulation without sessions: it collects their protocol, windows, number and whether they are kept."""

    def _sit(self, stage, loaded, day, number, is_kept) -> Any:
        protocol = loaded.settings
        told = (protocol.name.partition("-")[0], protocol.windows.count, number, is_kept)
        self.sat = [*getattr(self, "sat", []), told]
        return SimpleNamespace(touches=[]), None


@pytest.fixture(autouse=True)
def _no_stage(monkeypatch):
    for name in ("cached_training", "training_setup", "flight_setup", "familiarisation_setup"):
        monkeypatch.setattr(people, name, lambda *_: SimpleNamespace(left_over_Nm=None, friction_Nm=None))


def sat_through(condition: str) -> list[tuple[str, int, int, bool]]:
    """Sessions of the trained person in this condition."""
    options = StudyOptions((1, 1), (2, 1), ("dam", "parabolic"), compared=(1, 1), windows=8, flight_windows=1)
    career = next(one for one in careers(options, CODES) if one.condition_name == condition)
    life = Told(career, options, Path(), lambda _text, _share: None)
    life.run()
    return life.sat


def test_trainings_and_the_last_flight_are_the_studys():
    kept = [(name, number) for name, _, number, is_kept in sat_through("dam") if is_kept]
    assert kept == [("training", 1), ("training", 2), ("flight", 1)]


def test_flights_after_a_training_in_flight_are_as_long_as_all_others():
    assert [windows for _, windows, _, _ in sat_through("parabolic")] == [8, 1]
    assert [windows for _, windows, _, _ in sat_through("dam")] == [8, 1, 8, 1]


def test_a_machine_that_is_refused_is_one_person_less_in_a_comparison_and_an_error_in_the_main_study(monkeypatch):
    def refuse(*_):
        raise IdentificationError("Joint 'elbow' did not move.")

    monkeypatch.setattr(people, "cached_training", refuse)
    options = StudyOptions((1, 1), (2, 1), ("dam", "gcm"), compared=(1, 1))
    by_name = {one.condition_name: one for one in careers(options, CODES) if one.person == 0}
    lived = Told(by_name["gcm"], options, Path(), lambda _text, _share: None).run()
    assert (lived.flights, lived.refused) == ((), "Joint 'elbow' did not move.")
    with pytest.raises(IdentificationError, match="did not move"):
        Told(by_name["dam"], options, Path(), lambda _text, _share: None).run()
