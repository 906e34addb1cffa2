"""The progress of a simulated session names windows, and the rests between them, which are longer."""

import pytest
from tests.task.of_run import fed, short_plan

from exograv.experiment.train.lockstep_screen import phase_of
from exograv.task.events import Interrupted, Pause, Resume, Start, Tick
from exograv.task.run import TaskRun


def test_a_rest_is_not_called_a_window():
    run = TaskRun(short_plan(windows=2))  # windows from 35 s and 77 s, of 22 s each
    fed(run, [Start(t=0.0)])
    told = list[str]()
    for t in range(120):
        fed(run, [Tick(t=float(t))])
        told.append(phase_of(run))
    assert list(dict.fromkeys(told)) == [
        "Rest of 35 s before window 1 of 2",
        "Window 1 of 2",
        "Rest of 20 s before window 2 of 2",
        "Window 2 of 2",
        "Rest of 10 s after the last window",
    ]


@pytest.mark.parametrize(
    ("events", "told"),
    [
        ([Interrupted(t=300.0), Resume(t=300.0)], "Rest of 10 s before window 1 of 2, attempt 2"),
        ([Tick(t=60.0), Pause(t=60.0), Resume(t=70.0)], "Rest of 23 s before window 2 of 2"),
        ([Pause(t=40.0), Resume(t=50.0), Tick(t=61.0)], "Window 1 of 2, attempt 2"),
    ],
)
def test_a_resumed_session_says_how_long_it_rests_and_which_window_it_repeats(events: list, told: str):
    run = TaskRun(short_plan(windows=2))
    fed(run, [Start(t=0.0), Tick(t=40.0), *events])
    assert phase_of(run) == told
