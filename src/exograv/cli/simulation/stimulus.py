"""Command `exograv dev stimulus`."""

from typing import TYPE_CHECKING

from exograv.laboratory.options import StimulusOptions

if TYPE_CHECKING:
    from exograv.laboratory.stimulus.stimulus_command import StimulusResult


def run_stimulus_command(options: StimulusOptions) -> "StimulusResult":
    """Let the virtual participant of `run train --simulate --stimulus` point at the session's page in Chromium."""
    from exograv.laboratory.stimulus.stimulus_command import run_stimulus

    result = run_stimulus(options, lambda line: print(line, flush=True))
    print(
        f"{len(result.made)} touches made, {result.unsent} not delivered. The run "
        + ("has come to its end." if result.is_complete else "has not come to its end."),
        flush=True,
    )
    return result
