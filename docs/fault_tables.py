"""Page of all faults: budgets, limits, causes of known misses and tests, from the tables that judge the campaigns."""

from exograv.campaigns.faults.acceptance import Measure
from exograv.campaigns.faults.fault_table import FAULTS, Fault
from exograv.campaigns.faults.fault_tests import TESTED_FAULTS, TestedFault
from exograv.campaigns.faults.known_misses import KNOWN_MISSES

LIMITS = {
    Measure.STATE: "safe state {}",
    Measure.STEP: "change of torque {:.3g} N·m per tick",
    Measure.SPEED: "joint {:g} rad/s",
    Measure.WAY: "joint {:g}°",
    Measure.ENERGY: "{:g} J into the person",
    Measure.HAND: "hand {:g} m/s",
    Measure.DRIFT: "joint {:g}°/s over half a second",
    Measure.POWER: "{:g} W into the person",
    Measure.TORQUE_CHANGE: "change of the arm's torque {:.3g} N·m/s",
    Measure.ARM_BOUND: "first moments of the arm within their bounds",
}
"""Limit of each measure as text."""


def fault_page() -> str:
    """Return the page: a table of the flown faults, the causes of known misses, and faults with tests of their own."""
    parts = [
        "# Faults",
        "`exograv dev faults` flies these faults ([faults on purpose](../../explanation/safety.md#faults-on-purpose)). "
        "The budget is the time from the beginning of the fault to the first command of the safe state. The limits "
        "hold for what the fault adds.",
        "| fault | description | safe state | budget [ms] | limits |\n|---|---|---|---|---|\n"
        + "\n".join(map(fault_row, FAULTS.values())),
        "## Known misses",
        "These misses still count. The command fails for every other miss, and for a known one above its bound.",
        miss_list(),
        "## Faults with tests of their own",
        "\n".join(map(tested_line, TESTED_FAULTS)),
    ]
    return "\n\n".join(parts) + "\n"


def miss_list() -> str:
    """Return a line for each cause, with all misses that it explains."""
    misses: dict[str, list[str]] = {}
    for (fault, measure), miss in KNOWN_MISSES.items():
        bound = "any value" if miss.up_to is None else f"up to {miss.up_to:g}"
        bound = "as fast as a fall" if miss.by_fall else bound
        misses.setdefault(miss.cause, []).append(f"**{fault}** `{measure.value}` ({bound})")
    return "\n".join(f"- {', '.join(explained)}: {cause}" for cause, explained in misses.items())


def fault_row(fault: Fault) -> str:
    """Return the row of a fault that is flown."""
    state = "the drive's brake" if fault.at_drive else f"SS{int(fault.safe_state)}" if fault.safe_state >= 0 else "–"
    budget = f"{fault.budget_ms:g}" if fault.budget_ms is not None else "no stop" if fault.is_borne else "–"
    limits = "; ".join(LIMITS[measure].format(limit) for measure, limit in fault.limits.items())
    return f"| {fault.id} | {fault.what.replace('|', '∣')} | {state} | {budget} | {limits} |"


def tested_line(fault: TestedFault) -> str:
    """Return the line of a fault that tests prove, or that has no test yet."""
    tests = ", ".join(f"`{test}`" for test in fault.proved_by)
    cells = ", ".join(f"`{cell}`" for cell in fault.cells)
    return f"- **{fault.id}**: {fault.what}. Tests: {tests or 'none'}." + (
        f" Process faults: {cells}." if cells else ""
    )
