"""Command `exograv arm identify-log`."""

from typing import TYPE_CHECKING

from exograv.procedures.machine_tools.options import LogOptions

if TYPE_CHECKING:
    from exograv.procedures.machine_tools.identify_log import LogResult


def run_identify_log(options: LogOptions) -> "LogResult":
    """Identify a payload from recorded logs of a robot, with the same methods on real motors."""
    from exograv.cli.shell.terminal import FIRST_LINE_S, bars, show_payload
    from exograv.procedures.machine_tools.identify_log import identify_log

    with bars(FIRST_LINE_S) as progress:
        result = identify_log(options, progress)
    show_payload(result)
    return result
