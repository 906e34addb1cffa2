"""Terminal output of a run: one line per row, then limits, ratios and missing implementations."""

from collections.abc import Iterable
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from peers.opponents import Native

from .ratios import advantage

RATIO_WORDS = {
    "rnea_vs_pinocchio": "inverse dynamics of 7 joints, one call from Python, against Pinocchio",
    "tick_vs_c": "aligned tick of 7 joints, one call from Python, against CasADi's generated C",
    "batch_tick_vs_c": "aligned tick of 7 joints, 1024 states a call, one core, against CasADi's generated C",
    "tick_vs_jax": "aligned tick of 7 joints, one call from Python, against JAX",
    "batch_tick_vs_jax": "aligned tick of 7 joints, 1024 states a call, one core, against JAX with vmap",
    "batch_rnea_vs_c": "inverse dynamics, 1024 states a call, one core, against CasADi's generated C",
    "batch_rnea_vs_jax_vmap": "inverse dynamics, 1024 states a call, one core, against JAX with vmap",
    "batch_rnea_vs_pinocchio": "inverse dynamics, 1024 states a call, one core, against Pinocchio",
}


def show_bench(result: dict[str, Any]) -> None:
    """Print the whole result."""
    console = Console()
    for line in machine_lines(result["machine"]):
        console.print(line, highlight=False)
    console.print(_rows_table(result["rows"]))
    if result["limits"]:
        console.print(_limits_table(result))
    for entry in result["memory"]:
        console.print(
            f"{entry['name']}, {entry['implementation']}: {entry['rss_added_MB']:.0f} MB of memory added"
            + ("" if entry["code_bytes"] is None else f", {entry['code_bytes'] / 1000:.0f} kB of code"),
            highlight=False,
        )
    for entry in result["missing"]:
        rows = entry["rows"][0] if len(entry["rows"]) == 1 else f"{len(entry['rows'])} rows"
        console.print(f"missing: {entry['implementation']}, {rows}: {entry['reason']}", highlight=False, soft_wrap=True)
    for name, value in result["ratios"].items():
        said = "unknown: one of the two is missing" if value is None else f"{value:g} times faster"
        console.print(f"{RATIO_WORDS[name]}: {said}", highlight=False)


def machine_lines(machine: dict[str, Any]) -> list[str]:
    """Return lines about the computer, the versions, and a warning if the computer had other work."""
    frequency = "" if machine["frequency_MHz"] is None else f" at {machine['frequency_MHz']} MHz"
    lines = [
        f"{machine['cpu']}{frequency}, {machine['cores']} cores, {machine['os']}, Python {machine['python']}",
        "; ".join(f"{name} {version}" for name, version in machine["versions"].items()),
    ]
    if machine["busy"]:
        lines.append(
            f"This computer was busy before the run (load {machine['load_before']:.2f}): the figures are "
            "disturbed; ratios are more reliable than times. Close other programs and repeat."
        )
    return lines


def _rows_table(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="exograv native against the fastest other, median", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("row", "exograv", "p99.9", "fastest other", "median", "times"):
        is_name = heading in ("row", "fastest other")
        table.add_column(heading, justify="left" if is_name else "right", overflow="fold", no_wrap=not is_name)
    for name in names_of(rows):
        table.add_row(*_cells(name, [row for row in rows if row["name"] == name]))
    return table


def names_of(rows: Iterable[dict[str, Any]]) -> list[str]:
    """Return the names of all rows, each once, in order."""
    return list(dict.fromkeys(row["name"] for row in rows))


def _cells(name: str, rows: list[dict[str, Any]]) -> list[str]:
    ours = next((row for row in rows if row["implementation"] == Native.name), None)
    others = [row for row in rows if row is not ours]
    if not others:
        return [name, figure(ours, "p50"), figure(ours, "p999"), "", "", ""]
    best = fastest(others)
    times = "" if ours is None else f"{advantage(ours, best):.1f}"
    return [name, figure(ours, "p50"), figure(ours, "p999"), best["implementation"], figure(best, "p50"), times]


def fastest(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the fastest of rows with one name, by median."""
    return min(rows, key=lambda row: row["p50"] if row["unit"] == "us" else -row["p50"])


def figure(row: dict[str, Any] | None, key: str) -> str:
    """Return a value with its unit and three digits."""
    if row is None:
        return "–"
    value = row[key]
    if row["unit"] == "us":
        return f"{value / 1e3:.3g} ms" if value >= 1e3 else f"{value:.3g} µs"
    return f"{value / 1e6:.3g} M/s" if value >= 1e6 else f"{value / 1e3:.3g} k/s"


def _limits_table(result: dict[str, Any]) -> Table:
    title = "What one core could do at best (µs; batch: M/s), and the share that is reached"
    table = Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in LIMIT_HEADINGS:
        table.add_column(heading, justify="left" if heading == "program" else "right", overflow="fold")
    for entry in result["limits"]:
        table.add_row(*limit_cells(entry, result["rows"]))
    return table


LIMIT_HEADINGS = ("program", "instruc-\ntions", "chain", "units", "meas-\nured", "", "batch", "")


def limit_cells(limit: dict[str, Any], rows: list[dict[str, Any]]) -> list[str]:
    """Return the cells of a program: shortest times by longest chain and by busiest unit, and measured time [µs]."""
    single = _ours(rows, limit["name"])
    batch = _ours(rows, f"batch_{limit['name']}_1024_f64_one_core")
    own = None if single is None else max(single["p50"] - limit["call_us"], 1e-3)
    return [
        limit["name"],
        str(limit["instructions"]),
        f"{limit['critical_path_us']:.3g}",
        f"{limit['throughput_us']:.3g}",
        "–" if own is None else f"{own:.3g}",
        "–" if own is None else f"{100 * limit['best_us'] / own:.0f} %",
        f"{1 / limit['best_batch_us']:.3g}",
        "–" if batch is None else f"{100 * limit['best_batch_us'] * batch['p50'] / 1e6:.0f} %",
    ]


def _ours(rows: list[dict[str, Any]], name: str) -> dict[str, Any] | None:
    return next((row for row in rows if row["name"] == name and row["implementation"] == Native.name), None)
