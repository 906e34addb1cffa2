"""Assessment of a computer: its timing against the criteria of docs/explanation/realtime.md for a machine that is worn.

The criteria are necessary, not sufficient: bus, drives, their watchdog and the hardware emergency stop are not tested
here.
"""

from dataclasses import dataclass

from .host import Host
from .realtime import Rights
from .timing import LoopOutcome, Timing

SELF_TEST_S = 10.0
"""Shortest run that is judged [s]. Source: start-up self-test, docs/explanation/safety.md."""

WOKEN_WITHIN_NS = 200_000
"""Latest start of a tick [ns]; the measurement is then a fifth of a period old. Source: as above."""

WOKEN_SHARE_MIN = 0.999
"""Smallest share of periods that start in time; the rest may be later, but never by a period. Source: as above."""

MISSED_MAX = 0
"""Largest number of periods without their own command.

The guard bridges three and then lets the arm down; in a test there must be none. Source: as above ("none over 1 ms"),
and fault F14 there.
"""

RATIO_GOAL = 1e-5
"""Share of missed periods that a real-time host stays below, as a goal of the project, not of a standard."""

ZERO_SEEN_BOUND = 3.0
"""Numerator of the bound on a share of which none was seen.

None in n bounds the share by 3/n at 95 % confidence. Source: Hanley & Lippman-Hand 1983, JAMA 249:1743.
"""

PERIODS_FOR_GOAL = round(ZERO_SEEN_BOUND / RATIO_GOAL)
"""Number of periods without a miss that shows that the goal is met."""


@dataclass(frozen=True)
class Fitness:
    """Assessment of a computer."""

    may_drive_worn: bool
    """True if the timing allows to drive a machine that is worn."""

    reasons: list[str]
    """Reasons against the computer; for an accepted one, what the run has shown and what it has not."""

    prepare: list[str]
    """Next steps for the operator, most effective first."""


def judge(timing: Timing, rights: Rights, host: Host) -> Fitness:
    """Assess a run of the loop that had all the rights the system gave."""
    against = [*_rights(rights, host), *_punctuality(timing)]
    return Fitness(not against, against or _shown(timing, host), _prepare(rights, host))


def _rights(rights: Rights, host: Host) -> list[str]:
    """Return reasons why even a good run may not be repeatable."""
    found = []
    if host.is_virtual:
        found.append("It is a virtual machine: its host can stop it at any time, for longer than any test shows.")
    if not rights.is_fifo:
        found.append("Without real-time scheduling any other program can delay the loop.")
    if not rights.is_locked:
        found.append("Without locked memory a page that is fetched from disk can delay the loop.")
    return found


def _punctuality(timing: Timing) -> list[str]:
    found = []
    if timing.outcome is not LoopOutcome.COMPLETE:
        found.append(timing.outcome.value)
    if timing.seconds < SELF_TEST_S:
        found.append(f"{timing.seconds:g} s are too short to judge; it takes {SELF_TEST_S:g} s with real-time rights.")
    share = timing.woken_within(WOKEN_WITHIN_NS)
    if share < WOKEN_SHARE_MIN:
        found.append(
            f"{_percent(share)} of the ticks started within {WOKEN_WITHIN_NS // 1000} µs; "
            f"required are {_percent(WOKEN_SHARE_MIN)}."
        )
    if timing.missed > MISSED_MAX:
        found.append(
            f"{timing.missed} of {timing.periods} periods ended without their command; allowed: 0. The longest "
            f"gap was {1e-3 * timing.longest_gap_us:.1f} ms."
        )
    return found


def _percent(share: float) -> str:
    # The share is cut off, not rounded: 99.97 % must not read 100 %, nor 99.89 % as 99.9 %.
    return f"{int(share * 1e4 + 1e-6) / 1e2:g} %"  # the small term is for binary fractions


def _shown(timing: Timing, host: Host) -> list[str]:
    """Return sentences on the evidence of a good run, and on its limits."""
    found = [
        f"{_percent(timing.woken_within(WOKEN_WITHIN_NS))} of {timing.periods} ticks started within "
        f"{WOKEN_WITHIN_NS // 1000} µs, and no period ended without its command."
    ]
    bound = ZERO_SEEN_BOUND / timing.periods
    if bound > RATIO_GOAL:
        found.append(f"That shows at most 1 missed period in {1 / bound:.0f}; the goal is 1 in {1 / RATIO_GOAL:.0f}.")
    if not host.is_realtime_kernel:
        found.append("The kernel is not PREEMPT_RT: long delays were not seen, but nothing bounds them.")
    return found


def _prepare(rights: Rights, host: Host) -> list[str]:
    steps = []
    if host.is_virtual:
        steps.append("Use a computer of its own, without a hypervisor below its kernel.")
    steps.extend(rights.refused)
    if not host.is_realtime_kernel:
        steps.append("Boot a PREEMPT_RT kernel (Debian: linux-image-rt-amd64).")
    if not host.isolated_cpus:
        steps.append(_isolate(host))
    if any(governor != "performance" for governor in host.governors):
        steps.append("Keep the processors' frequency up: cpupower frequency-set -g performance.")
    if host.clock_source in ("hpet", "acpi_pm"):
        steps.append(f"Find out why the kernel reads time from '{host.clock_source}', which is slow, and not from tsc.")
    return steps


def _isolate(host: Host) -> str:
    if len(host.cpus) < 2:
        return "Use a computer with two processors or more: recorder and console must not wait for the loop."
    return f"Keep one processor for the loop: boot with isolcpus={host.cpus[-1]}, other interrupts on the rest."
