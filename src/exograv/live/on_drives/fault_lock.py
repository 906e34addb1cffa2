"""Lock of a machine on drives after a fault: the pass of its self-test is withdrawn."""

from collections.abc import Collection

from exograv.live.guard_job import GuardReport
from exograv.safety.stops import StopReason
from exograv.storage.self_test_pass import MachineKey, withdraw_pass


def lock_after_fault(key: MachineKey, report: GuardReport, on_purpose: Collection[StopReason] = ()) -> str:
    """Lock the machine if a fault has stopped it, until a self-test passes again. Stop itself is no fault.

    Args:
        key: Machine to lock.
        report: Report of its guard.
        on_purpose: Reasons of a stop that an acceptance causes; it locks the machine itself at its end.

    Returns:
        The cause of the fault; empty without a fault.

    Raises:
        ConfigError: The file of the self-test is damaged, or cannot be written.
    """
    no_faults = {reason.value for reason in (StopReason.STOP_PRESSED, *on_purpose)}
    causes = [latch.cause for latch in report.latches if latch.cause not in no_faults]
    cause = report.failure or next(iter(causes), "")
    if cause:
        withdraw_pass(key.file, cause)
    return cause
