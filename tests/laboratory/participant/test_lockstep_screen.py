"""The progress of a simulated session names windows, and the rests between them, which are longer."""

from tests.task.of_run import fed, short_plan

from exograv.laboratory.participant.lockstep_screen import phase_of
from exograv.task.events import Start, Tick
from exograv.task.run import TaskRun


def test_a_rest_is_not_called_a_window():
    run = TaskRun(short_plan(windows=2))  # windows from 35 s and 77 s, of 22 s each
    fed(run, [Start(t=0.0)])
    told = list[str]()
    for t in range(120):
        fed(run, [Tick(t=float(t))])
        told.append(phase_of(run))
    assert list(dict.fromkeys(told)) == [
        "Rest before window 1 of 2",
        "Window 1 of 2",
        "Rest before window 2 of 2",
        "Window 2 of 2",
        "Rest after the last window",
    ]
