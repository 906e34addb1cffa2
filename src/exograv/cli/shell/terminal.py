"""Terminal output: progress during a run, and tables of results."""

from collections.abc import Callable, Iterator, Sequence
from math import log10
from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from .end_signals import terminal_may_close
from .progress import FIRST_LINE_S as FIRST_LINE_S
from .progress import bars as bars

if TYPE_CHECKING:
    from exograv.laboratory.demo_result import DemoFindings, DemoResult, FloatedArm, ModelNotes, ParticipantFigures
    from exograv.live.on_drives.bring_up_command import BringUpStep
    from exograv.procedures.machine_tools.identify_log import LogResult
    from exograv.procedures.self_test.loop_timing import LatenessHistogram, LoopFigures, ScheduledLoop
    from exograv.procedures.self_test.self_test_command import StepFigures


def say(text: str) -> None:
    """Print a line for the operator."""
    with terminal_may_close():
        Console().print(text, highlight=False, markup=False)


def say_unbroken(text: str) -> None:
    """Print a line with a path, which a narrow terminal must not break."""
    Console().print(text, highlight=False, markup=False, soft_wrap=True)


def show_steps(title: str, steps: "Sequence[tuple[str, StepFigures | BringUpStep]]") -> None:
    """Print the steps of a test by their shown names, and below them what to do after a failure."""
    table = Table(title=title)
    # A narrow terminal breaks words instead of cutting off figures.
    for heading in ("step", "measured", "limit", ""):
        is_figure = heading in ("measured", "limit")
        table.add_column(heading, justify="right" if is_figure else "left", overflow="fold")
    for name, step in steps:
        mark = {True: "ok", False: "FAILED", None: "not tried"}[step.passed]
        table.add_row(name, _cell(step.measured), f"{_cell(step.limit)} {step.unit}".strip(), mark)
    Console().print(table)
    for _, step in steps:
        if step.what_to_do:
            say(f"{step.name}: {step.what_to_do}")


def _cell(value: float | str | None) -> str:
    return "" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)


def show_demo(result: "DemoResult") -> None:
    """Print the closing table of `demo` and `identify`."""
    found = result.findings
    table = Table(
        title=f"{found.rig}, disturbance level {found.disturbance_level}, world {found.world}, seed {found.seed}"
    )
    table.add_column("left over (true), N·m RMS")
    for label in ("exo\nonly", "by\ntable", "arm\nfound"):
        table.add_column(label, justify="right")
    total = found.arm.left_over_rms_Nm.total
    for joint, *values in zip(found.joints, total.exo_only or (), total.table, total.identified, strict=True):
        table.add_row(joint.replace("_", " "), *(f"{value:.2f}" for value in values))
    console = Console()
    console.print(table)
    lines = [*_of_identification(found), *_of_floated(found.floated), *_of_person(result.person)]
    for line in [*lines, *_of_wearer_model(result.wearer_model), *_of_run(result)]:
        console.print(line, highlight=False)
    console.print(f"Report: {result.report}", highlight=False, soft_wrap=True)


def _of_identification(found: "DemoFindings") -> Iterator[str]:
    """Yield lines on the identification: time, method, uncertainty, identifiable parameters, and relaxation."""
    arm, times = found.arm, found.arm.identification
    reached = times.time_to_target_s
    verdict = f"{times.outcome.value} {times.why}".rstrip()
    yield f"Estimator '{found.method}' after {times.motion_s:.0f} s of motion: {verdict}"
    within = _missed_target(found) if reached is None else f"is within its target from {reached:.0f} s on"
    yield (
        f"True value, which only a simulation knows: the left over {within} "
        "(targets: shoulder 0.2, elbow 0.1, wrist 0.05 N·m)."
    )
    yield found.comparison.text
    if arm.possible_left_over_Nm is not None:
        limits = ", ".join(f"{value:.2f}" for value in arm.possible_left_over_Nm.p95)
        yield f"By the uncertainty of the estimate, left over is at most {limits} N·m for 95 % of the possible arms."
    if arm.identifiability is not None:
        told = arm.identifiability
        yield (
            f"The motion determined {len(told.by_data)} of {told.learnable} parameters, in "
            f"{len(told.base_parameters)} combinations; the others come from the prior."
        )
    if times.restless_s is not None:
        yield f"The person did not relax from {times.restless_s:.0f} s on."


def _of_wearer_model(model: "ModelNotes | None") -> Iterator[str]:
    """Yield lines on a third party's arm: its title, and which parts of it are not used."""
    if model is not None:
        yield escape(f"Arm model: {model.title}.")
        yield from map(escape, model.notes)


def _missed_target(found: "DemoFindings") -> str:
    """Say by how much the true left over misses its target, at which joints."""
    from exograv.study.targets import target_of

    missed = []
    for joint, value in zip(found.joints, found.arm.left_over_rms_Nm.total.identified, strict=True):
        target = target_of(joint)
        if value > target:
            missed.append(f"at {joint.replace('_', ' ')} by {value - target:.2f} N·m")
    if missed:
        return f"misses its target {', '.join(missed)}"
    return "is within its target at the end, but was beyond it again during the motion"


def _of_floated(floated: "FloatedArm | None") -> Iterator[str]:
    if floated is None:
        return
    drift = ", ".join(f"{angle:.1f}°" for angle in floated.float.drift_deg)
    yield (
        f"Floated for {floated.float.window_s:.0f} s: the joints drifted by {drift}. Friction of the drives holds a "
        "still arm, so a small drift says little; the left over says more."
    )
    if floated.float.gravity_level > 0.0:
        yield "The virtual wearer is relaxed: the felt share of the weight lets the arm sink."
    weight = floated.known_weight.weight
    low, high = weight.ci95_kg
    yield (
        f"Known weight of {weight.true_kg:.3f} kg: found {weight.estimated_kg:.3f} kg "
        f"(95 % interval {low:.3f} to {high:.3f} kg)."
    )


def _of_person(person: "ParticipantFigures") -> Iterator[str]:
    """Yield lines on the time that a participant's file saved, and on the new file."""
    before, kept = person.participant, person.participant_kept
    if person.participant_warning:
        yield person.participant_warning
    if before is not None:
        file, examiner = before.by_prediction, before.examiner
        times = (file.from_file.predicted_target_s, file.cold.predicted_target_s, examiner.from_file_s, examiner.cold_s)
        warm, cold, true_warm, true_cold = ("not within this motion" if t is None else f"{t:.0f} s" for t in times)
        yield (
            f"Warm start from the file of {file.code}: predicted within the target of the stop rule after {warm}; from "
            f"the table on the same samples: {cold}. By the truth of the twin: {true_warm}; {true_cold}."
        )
    if kept is not None:
        if kept.file is None:
            yield kept.why
        else:
            yield f"{kept.code} is kept in {kept.file}, donning {kept.donnings}. {kept.warning}".rstrip()


def _of_run(result: "DemoResult") -> Iterator[str]:
    used = result.findings.calibration_used
    if used.source == "stored":
        yield f"Calibration {used.hash[:12]}…, measured {used.measured_utc}. {used.warning or ''}".rstrip()
    tick = result.tick_us
    yield f"Tick {tick['p50']:.0f} µs (p99 {tick['p99']:.0f} µs); {result.wall_s:.0f} s in total."


def show_payload(result: "LogResult") -> None:
    """Print the closing lines of `identify-log`."""
    console, payload = Console(), result.payload
    text = f"Payload: {payload.mass_kg:.3f} kg"
    if payload.ci95_kg is not None:
        low, high = payload.ci95_kg
        text += f" (95 % interval {low:.3f} to {high:.3f} kg)"
    x, y, z = payload.com_m
    console.print(f"{text}, centre at ({x:.3f}, {y:.3f}, {z:.3f}) m in the payload frame.", highlight=False)
    if result.time_to_10pct_s is not None:
        console.print(f"Within 10 % of the true mass from {result.time_to_10pct_s:.1f} s on.", highlight=False)
    console.print(f"{result.duration_s:.1f} s, {result.samples} samples. {result.outcome.value}", highlight=False)


NARROW = 60
"""Terminal width below which only numbers have room [columns]."""


LOOP_FIGURES: dict[str, Callable[["ScheduledLoop"], str]] = {
    "commands/s": lambda row: f"{row.effective_rate_Hz:.1f}",
    "longest gap, ms": lambda row: f"{row.longest_gap_us / 1000:.2f}",
    "late > 0.5 ms": lambda row: f"{100 * row.late_share:.2f} %",
    "missed periods": lambda row: f"{row.missed}",
}
LOOP_TIMES = {"woken late, µs": "lateness_us", "computing, µs": "compute_us", "whole tick, µs": "command_us"}
PERCENTILES = {"median": "p50", "99 %": "p99", "99.9 %": "p999", "worst": "max"}


def show_loop(loop: "LoopFigures") -> None:
    """Print the timing of the live loop for both kinds of scheduling, and the verdict."""
    console = Console()
    ordinary, realtime = loop.rows
    console.print(_loop_table(loop, console.width))
    console.print("Ticks by how late they started, ordinary and real-time:", highlight=False)
    for line in histogram_lines(ordinary.histogram, realtime.histogram, console.width):
        console.print(line, highlight=False)
    console.print(f"Real-time rights: {', '.join(realtime.granted)}.", highlight=False)
    can = "may" if loop.may_drive_worn else "must not"
    console.print(f"By its timing this computer {can} drive a worn machine:", style="bold", highlight=False)
    _list(console, loop.reasons)
    if loop.prepare:
        console.print("To prepare it (docs/explanation/realtime.md):", highlight=False)
        _list(console, loop.prepare)


def _loop_table(loop: "LoopFigures", width: int) -> Table:
    rows = loop.rows
    table = Table(title=f"Live loop, {loop.rate_Hz / 1000:g} kHz, {rows[0].seconds:g} s each way")
    table.add_column()
    for heading in (row.scheduling for row in rows):
        table.add_column(heading.replace("-", "-\n") if width < NARROW else heading, justify="right")
    for label, figure in LOOP_FIGURES.items():
        table.add_row(label, *(figure(row) for row in rows))
    for label, key in LOOP_TIMES.items():
        table.add_section()
        table.add_row(label)
        for name, percentile in PERCENTILES.items():
            table.add_row(f"  {name}", *(f"{getattr(getattr(row, key), percentile):.0f}" for row in rows))
    return table


def _list(console: Console, sentences: list[str]) -> None:
    grid = Table.grid(padding=(0, 1))
    for sentence in sentences:
        grid.add_row("-", Text(sentence))
    console.print(grid)


def histogram_lines(ordinary: "LatenessHistogram", realtime: "LatenessHistogram", width: int) -> list[str]:
    """Return one line per bin, with bars if they fit. Bars are logarithmic, so that a single late tick is visible."""
    edges = ordinary.edges_us
    most = max(1, *ordinary.counts, *realtime.counts)
    room = min(20, (width - 42) // 2) if width >= NARROW else 0
    lines = []
    limits = [f"< {edge} µs" if edge < 1000 else f"< {edge / 1000:g} ms" for edge in edges[1:-1]]
    for label, *counts in zip([*limits, "later"], ordinary.counts, realtime.counts, strict=True):
        bars = (f"{count:8d} {_bar(count, most, room):{room}s}" for count in counts)
        lines.append(f"{label:>11s}{''.join(bars)}".rstrip())
    return lines


def _bar(count: int, most: int, room: int) -> str:
    return "" if count == 0 else "█" * round(room * (1 + log10(count)) / (1 + log10(most)))
