"""How many people the next study needs, from the spread that this one has seen and a difference that is stated."""

from exograv.study.measures.selecting import people
from exograv.study.measures.study_data import PRIMARY, StudyData
from exograv.study.power.assumptions import LOG_2, PlannedStudy
from exograv.study.power.curve import PowerResult, power_study
from exograv.study.power.options import CurveOptions, Price
from exograv.study.power.pilot import read_pilot

STUDIES = 2000
"""Simulated for each number of people: powers on the page are good to 0.02."""

N_MAX = 30


def next_study(data: StudyData, groups: tuple[str, str]) -> PowerResult | None:
    """Figures of `exograv study power` for half the deviation, the published difference; None with fewer than three.

    The difference that the study itself found is not used: of a small study it is as a rule too large.

    Args:
        data: The study.
        groups: That are compared.
    """
    if people(data.compared) < 3:
        return None
    pilot = read_pilot(data.tidy_touches, data.tables.participants, groups, PRIMARY)
    plan = PlannedStudy(
        difference=LOG_2,
        person_sd=pilot.grid.person_sd_quantile(0.5),
        touch_sd=pilot.touch_sd,
        window_sd=pilot.window_sd,
        windows=pilot.windows,
        touches=round(max(1.0, pilot.touches_per_window)),
    )
    return power_study(plan, Price(None, None), CurveOptions(N_MAX, STUDIES), lambda what, share: None, pilot)
