"""Number of people for a next study, from the spread in this study and a stated difference."""

from exograv.study.measures.selecting import people
from exograv.study.measures.study_data import PRIMARY, StudyData
from exograv.study.power.assumptions import LOG_2, PlannedStudy
from exograv.study.power.curve import PowerResult, power_study
from exograv.study.power.options import CurveOptions, Price
from exograv.study.power.pilot import read_pilot

STUDIES = 2000
"""Number of simulated studies for each number of people. Powers on the page are accurate to 0.02."""

N_MAX = 30


def next_study(data: StudyData, groups: tuple[str, str]) -> PowerResult | None:
    """Compute the power of a next study; None with fewer than three people.

    The figures are those of `exograv study power` for half the deviation, which is the published difference. The
    difference that the study itself found is not used, because in a small study it is usually too large.

    Args:
        data: The study.
        groups: The compared groups.
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
