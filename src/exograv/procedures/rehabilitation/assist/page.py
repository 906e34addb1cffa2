"""The therapist's page of one participant: support against block with its bounds, and every decision in words."""

from pathlib import Path

from markupsafe import Markup

from exograv.files import write_whole
from exograv.report.style.templates import template

from .participant_record import AssistFile
from .words import Words


def write_assist_page(path: Path, file: AssistFile, words: Words) -> None:
    """Of all sessions in the file, and of nothing else.

    Raises:
        RecordingError: The folder cannot be written.
    """
    from exograv.report.figures.assist import draw_assist
    from exograv.report.style.figure_style import house_style, inline_svg  # Matplotlib: 0.4 s

    with house_style():
        svg = inline_svg(draw_assist(course(file), words.page), "assist", letters="path")
    write_whole(path, render(file, words, Markup(svg)))


def course(file: AssistFile) -> list[dict[str, object]]:
    """Each block as the picture needs it."""
    return [
        {
            "session": session.number,
            "support": block.support_percent,
            "share": sum(block.reached) / len(block.reached),
            "sank": block.sank,
            "low": max(
                session.protocol.rule.least_percent, session.began_percent - session.protocol.rule.session_percent
            ),
            "high": session.protocol.rule.most_percent,
        }
        for session in file.sessions
        for block in session.blocks
    ]


def render(file: AssistFile, words: Words, svg: Markup) -> str:
    """The page as text; the same sessions give the same text."""
    last = file.sessions[-1]
    rule, now = last.protocol.rule, f"{last.state.support_percent:g}"
    rows = [
        (
            str(session.number),
            str(number),
            f"{block.support_percent:g}",
            words.page("of", reached=sum(block.reached), tried=len(block.reached)),
            words.decided(block),
        )
        for session in file.sessions
        for number, block in enumerate(session.blocks, start=1)
    ]
    told = {"session": last.number, "began": f"{last.began_percent:g}", "blocks": len(last.blocks), "now": now}
    return template("assist.html.j2", "exograv.procedures.rehabilitation.assist", "exograv.report.study_report").render(
        language=words.language,
        study=words.page("title", participant=file.participant),
        headline=words.page("headline" if last.is_over else "going", **told),
        word=words.page,
        rule=words.page(
            "rule_text",
            lower=f"{100 * rule.lower_share:g}",
            raise_=f"{100 * rule.raise_share:g}",
            down=f"{rule.step_down_percent:g}",
            up=f"{rule.step_up_percent:g}",
            most=f"{rule.session_percent:g}",
            least=f"{rule.least_percent:g}",
        ),
        rows=rows,
        svg=svg,
        authors="",
        licence="",
        is_simulated=True,
        simulated=words.page("simulated"),
        tiles=[],
    )
