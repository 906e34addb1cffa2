"""The page of a transparency test: how much muscle the movement took, against what, and what it was spent on."""

from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from exograv.errors import RecordingError
from exograv.report.figures.transparency import CONDITIONS, GOALS, PROFILES, Result, draw_causes, draw_effort
from exograv.report.of_recording.headline import Tile
from exograv.report.style.figure_style import house_style, inline_svg, joint_label
from exograv.report.style.tables import Table
from exograv.report.style.templates import template

EFFORT_TEXT = (
    "Effort is the torque of the person's muscles, without its sign, summed over the movement and the joints. From "
    "left to right less and less is a burden: the machine with its motors off; its own weight carried; the arm "
    "carried too, as it was identified; the same by a controller that knows the truth; that one on a machine without "
    "friction; and real weightlessness without a machine. Bars are medians, dots are single machines, the dashed line "
    "is the goal."
)
CAUSES_TEXT = (
    "Each bar is what one more burden adds to the effort. Own inertia and elasticity would be there in real "
    "weightlessness too. A bar below zero means that a burden helps: friction also holds an arm that muscles would "
    "otherwise have to hold."
)


def write_transparency_report(results: Sequence[Result], html_path: Path) -> Path:
    """Write the page, or replace it; its folder is created too.

    Raises:
        RecordingError: The page cannot be written.
    """
    with house_style():
        chapters = [
            _chapter("effort", "How much muscle it takes", draw_effort(results), EFFORT_TEXT),
            _chapter("causes", "What it is spent on", draw_causes(results), CAUSES_TEXT),
        ]
    page = template("transparency.html.j2", "exograv.report.of_benchmarks", "exograv.report.of_recording").render(
        headline=headline(results),
        facts=_facts(results[0]),
        tiles=[tile for result in results for tile in _tiles(result)],
        remark=_remark(results),
        outcome=None,
        chapters=chapters,
        tables=[effort_table(result) for result in results],
        joints=[],
    )
    try:
        html_path.parent.mkdir(parents=True, exist_ok=True)
        html_path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise RecordingError(
            f"The report {html_path} cannot be written: {error.strerror}. Give another folder with --out."
        ) from error
    return html_path


def headline(results: Sequence[Result]) -> str:
    """What is left of the effort, in one sentence."""
    parts = [f"{_percent(result['dam_over_gcm']['effort'])} with {PROFILES[result['profile']]}" for result in results]
    return f"With the arm carried too, {' and '.join(parts)} of the muscle effort are left."


def effort_table(result: Result) -> Table:
    """One row a condition: total, every joint, squared, and how well the path was kept."""
    joints = [joint_label(joint) for joint in result["joints"]]
    rows = [
        (
            words.replace("\n", " "),
            f"{row['effort_Nms']:.1f}",
            *(f"{value:.1f}" for value in row["by_joint_Nms"]),
            f"{row['squared_N2m2s']:.0f}",
            f"{row['tracking_error_deg']:.2f}",
        )
        for name, words in CONDITIONS.items()
        if (row := result["conditions"].get(name))
    ]
    columns = ("condition", "effort N·m·s", *joints, "squared N²·m²·s", "path error °")
    note = f"Medians of {len(result['seeds'])} machines, {result['movement']} for {result['movement_s']:g} s."
    return Table(f"{PROFILES[result['profile']]}: {result['rig']}", note, columns, rows)


def _chapter(name: str, title: str, figure: Figure, text: str) -> dict[str, str]:
    return {"name": name, "title": title, "svg": Markup(inline_svg(figure, name)), "text": text}


def _facts(result: Result) -> list[tuple[str, str]]:
    facts = [
        ("movement", f"{result['movement']}, {result['movement_s']:g} s"),
        ("disturbance level", str(result["disturbance_level"])),
        ("machines", ", ".join(f"seed {seed}" for seed in result["seeds"])),
    ]
    if result["recorded_samples"]:
        facts.append(("recorded samples beyond reach", f"{result['clipped_samples']} of {result['recorded_samples']}"))
    return facts


def _tiles(result: Result) -> list[Tile]:
    words, goals = PROFILES[result["profile"]], GOALS.get(result["profile"], {})
    labels = {"effort": "effort left", "elbow": "elbow alone"}
    return [
        Tile(f"{label}, {words}", _percent(value), f"goal {_percent(goal)} of the machine carried alone", value <= goal)
        for name, label in labels.items()
        if (goal := goals.get(name)) is not None and (value := result["dam_over_gcm"][name]) is not None
    ]


def _remark(results: Sequence[Result]) -> str | None:
    strays = sum(len(result["off_path"]) for result in results)
    if not strays:
        return None
    runs = sum(len(result["seeds"]) * len(result["conditions"]) for result in results)
    return (
        f"In {strays} of {runs} performances the path was not kept within {results[0]['tracking_error_max_deg']:g}° by "
        "some joint; they count, and the figures name them."
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
