"""Lock of a machine on drives after a fault: the pass of its self-test is withdrawn."""

from exograv.live.guard_job import GuardReport
from exograv.safety.stops import StopReason
from exograv.storage.self_test_pass import MachineKey, withdraw_pass


def lock_after_fault(key: MachineKey, report: GuardReport) -> str:
    """Lock the machine if a fault has stopped it, until a self-test passes again. Stop itself is no fault.

    Returns:
        The cause of the fault; empty without a fault.

    Raises:
        ConfigError: The file of the self-test is damaged, or cannot be written.
    """
    causes = [latch.cause for latch in report.latches if latch.cause != StopReason.STOP_PRESSED.value]
    cause = report.failure or next(iter(causes), "")
    if cause:
        withdraw_pass(key.file, cause)
    return cause
