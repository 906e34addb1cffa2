"""What a person at a terminal sees: progress while it runs, one table when it is done."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table


@contextmanager
def bars() -> Iterator[Callable[[str, float], None]]:
    """A progress line, where standard error is a terminal; yields what takes a sentence and the share done."""
    columns = (TextColumn("{task.description}"), BarColumn(bar_width=24), TimeElapsedColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("Starting", total=1.0)
        current = ""

        def show(text: str, share: float) -> None:
            nonlocal current
            if text != current:
                current = text
                progress.reset(task, description=text)
            progress.update(task, completed=share)

        yield show


def show_demo(result: dict[str, Any]) -> None:
    """The closing table of `demo` and `identify`."""
    total = result["left_over_rms_Nm"]["total"]
    table = Table(title=f"{result['rig']}, disturbance level {result['disturbance_level']}, seed {result['seed']}")
    table.add_column("left over, N·m RMS")
    for joint in result["joints"]:
        table.add_column(joint.replace("_", "\n"), justify="right")
    labels = {
        "exo_only": "exoskeleton carried, arm not",
        "table": "arm by the table",
        "identified": f"arm identified ({result['method']})",
    }
    for key, label in labels.items():
        table.add_row(label, *(f"{value:.2f}" for value in total[key]))
    console = Console()
    console.print(table)
    identification = result["identification"]
    reached = identification["time_to_target_s"]
    lines = [
        f"Identified from {identification['motion_s']:.0f} s of motion. {identification['outcome']}",
        "Left over stays within 0.2 N·m (shoulder) and 0.1 N·m (elbow) "
        + ("never in this run." if reached is None else f"from {reached:.0f} s on."),
    ]
    if "float" in result:
        drift = ", ".join(f"{angle:.1f}°" for angle in result["float"]["drift_deg"])
        lines.append(f"Floated for {result['float']['window_s']:.0f} s: the joints drifted by {drift}.")
        if result["float"]["gravity_level"] > 0.0:
            lines.append("The virtual wearer is relaxed: the share of the weight that is felt lets the arm sink.")
    if "known_weight" in result:
        weight = result["known_weight"]
        low, high = weight["ci95_kg"]
        lines.append(
            f"Known weight of {weight['true_kg']:.3f} kg: found {weight['estimated_kg']:.3f} kg "
            f"(95 % interval {low:.3f} to {high:.3f} kg)."
        )
    tick = result["tick_us"]
    lines.append(f"Tick {tick['p50']:.0f} µs (p99 {tick['p99']:.0f} µs); {result['wall_s']:.0f} s for all of it.")
    for line in lines:
        console.print(line, highlight=False)
    console.print(f"Report: {result['report']}", highlight=False, soft_wrap=True)


def show_payload(result: dict[str, Any]) -> None:
    """The closing lines of `identify-log`."""
    console = Console()
    payload = result["payload"]
    text = f"Payload: {payload['mass_kg']:.3f} kg"
    if payload["ci95_kg"] is not None:
        low, high = payload["ci95_kg"]
        text += f" (95 % interval {low:.3f} to {high:.3f} kg)"
    x, y, z = payload["com_m"]
    console.print(f"{text}, centre at ({x:.3f}, {y:.3f}, {z:.3f}) m in the payload frame.", highlight=False)
    if result["time_to_10pct_s"] is not None:
        console.print(f"Within 10 % of the true mass from {result['time_to_10pct_s']:.1f} s on.", highlight=False)
    console.print(f"{result['duration_s']:.1f} s, {result['samples']} samples. {result['outcome']}", highlight=False)


def show_doctor(result: dict[str, Any]) -> None:
    """One line a check."""
    console = Console()
    console.print(result["computer"], highlight=False)
    for check in result["checks"]:
        mark = "ok " if check["ok"] else "NO "
        console.print(f"{mark} {check['name']}: {check['text']}", highlight=False)
