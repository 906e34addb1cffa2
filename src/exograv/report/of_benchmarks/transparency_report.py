"""Page of a transparency test: muscle effort of a movement in several conditions, and its causes."""

from collections.abc import Sequence
from pathlib import Path

from exograv.report.figures.transparency import CONDITIONS, GOALS, PROFILES, draw_causes, draw_effort
from exograv.report.figures.transparency_data import MachineTransparency
from exograv.report.of_recording.recording_report import SAFETY
from exograv.report.style.figure_style import house_style, joint_label
from exograv.report.style.page import SIMULATED, Chapter, Page, Table, Text, Tile, write_page

EFFORT_TEXT = (
    "Effort is the absolute torque of the person's muscles, summed over the movement and the joints. From left to "
    "right there is less and less load: the machine with its motors off; its own weight carried; the arm carried too, "
    "as it was identified; the same with a controller that knows the true values; the same on a machine without "
    "friction; and real weightlessness without a machine. Bars are medians, dots are single machines, the dashed line "
    "is the goal."
)
CAUSES_TEXT = (
    "Each bar is the effort that one further load adds. Own inertia and elasticity exist in real weightlessness too. A "
    "bar below zero means that a load helps: friction also holds an arm that muscles would otherwise have to hold."
)


ON_THE_TWIN = Text(
    "All results are from the twin: in every condition a virtual person practised the movement until the path was kept "
    "within one degree. The virtual person has no information about the controller."
)


def write_transparency_report(results: Sequence[MachineTransparency], html_path: Path) -> Path:
    """Write the page, or replace it; its folder is created too.

    Raises:
        RecordingError: The page cannot be written.
    """
    with house_style():
        figures = (
            Chapter("Muscle effort by condition", (), "effort", draw_effort(results), EFFORT_TEXT),
            Chapter("Causes of the effort", (), "causes", draw_causes(results), CAUSES_TEXT),
        )
    tables = [Chapter(f"{PROFILES[one.profile]}: {one.rig}", [_note(one), effort_table(one)]) for one in results]
    page = Page(
        headline=headline(results),
        simulated=SIMULATED,
        facts=_facts(results[0]),
        tiles=[tile for result in results for tile in _tiles(result)],
        lead=[*_remark(results), ON_THE_TWIN],
        chapters=[*figures, SAFETY, *tables],
        letters="none",
    )
    return write_page(html_path, page)


def headline(results: Sequence[MachineTransparency]) -> str:
    """Remaining share of the effort, in one sentence."""
    parts = [f"{_percent(result.dam_over_gcm.effort)} with {PROFILES[result.profile]}" for result in results]
    return f"With the arm carried too, {' and '.join(parts)} of the muscle effort remain."


def effort_table(result: MachineTransparency) -> Table:
    """Return one row per condition: total, every joint, squared, and the error of the path."""
    joints = [joint_label(joint) for joint in result.joints]
    rows = [
        (
            words.replace("\n", " "),
            f"{row.effort_Nms:.1f}",
            *(f"{value:.1f}" for value in row.by_joint_Nms),
            f"{row.squared_N2m2s:.0f}",
            f"{row.tracking_error_deg:.2f}",
        )
        for name, words in CONDITIONS.items()
        if (row := result.conditions.get(name))
    ]
    columns = ("condition", "effort N·m·s", *joints, "squared N²·m²·s", "path error °")
    return Table(columns, rows)


def _note(result: MachineTransparency) -> Text:
    return Text(f"Medians of {len(result.seeds)} machines, {result.movement} for {result.movement_s:g} s.")


def _facts(result: MachineTransparency) -> list[tuple[str, str]]:
    facts = [
        ("movement", f"{result.movement}, {result.movement_s:g} s"),
        ("disturbance level", str(result.disturbance_level)),
        ("world", result.world),
        ("machines", ", ".join(f"seed {seed}" for seed in result.seeds)),
    ]
    if result.recorded_samples:
        facts.append(("recorded samples beyond reach", f"{result.clipped_samples} of {result.recorded_samples}"))
    return facts


def _tiles(result: MachineTransparency) -> list[Tile]:
    words, goals = PROFILES[result.profile], GOALS.get(result.profile, {})
    labels = {"effort": "effort remaining", "elbow": "elbow alone"}
    return [
        Tile(
            f"{label}, {words}",
            _percent(value),
            f"goal: {_percent(goal)} of the effort with only the machine carried",
            value <= goal,
        )
        for name, label in labels.items()
        if (goal := goals.get(name)) is not None and (value := getattr(result.dam_over_gcm, name)) is not None
    ]


def _remark(results: Sequence[MachineTransparency]) -> list[Text]:
    strays = sum(len(result.off_path) for result in results)
    runs = sum(len(result.seeds) * len(result.conditions) for result in results)
    said = (
        f"In {strays} of {runs} performances a joint left the path by more than "
        f"{results[0].tracking_error_max_deg:g}°. These performances are included, and the figures name them."
    )
    return [Text(said, "notice")] if strays else []


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
