"""Therapist's page of one participant: support of each block with its bounds, and the reason of each decision."""

from pathlib import Path

from exograv.report.figures.assist import SupportBlock, draw_assist
from exograv.report.style.figure_style import house_style
from exograv.report.style.page import Chapter, Page, Table, Text, write_page

from .participant_record import AssistFile
from .words import AssistTexts


def write_assist_page(path: Path, file: AssistFile, words: AssistTexts) -> None:
    """Write the page of all sessions in the file.

    Raises:
        RecordingError: The folder cannot be written.
    """
    write_page(path, page_of(file, words))


def course(file: AssistFile) -> list[SupportBlock]:
    """Return the blocks of all sessions as the figure shows them."""
    return [
        SupportBlock(
            session=session.number,
            support=block.support_percent,
            share=sum(block.reached) / len(block.reached),
            sank=block.sank,
            low=max(session.protocol.rule.least_percent, session.began_percent - session.protocol.rule.session_percent),
            high=session.protocol.rule.most_percent,
        )
        for session in file.sessions
        for block in session.blocks
    ]


def page_of(file: AssistFile, words: AssistTexts) -> Page:
    """Return the content of the page. The same sessions give the same page."""
    word, last = words.page, file.sessions[-1]
    rows = [
        (
            str(session.number),
            str(number),
            f"{block.support_percent:g}",
            word("of", reached=sum(block.reached), tried=len(block.reached)),
            words.decided(block),
        )
        for session in file.sessions
        for number, block in enumerate(session.blocks, start=1)
    ]
    began, now = f"{last.began_percent:g}", f"{last.state.support_percent:g}"
    title = word("title", participant=file.participant)
    simulated = "" if file.options.get("drives") == "real" else word("simulated")
    with house_style():
        figure = draw_assist(course(file), word, bool(simulated))
    columns = (word("session"), word("block"), word("carried"), word("reached"), word("decision"))
    return Page(
        headline=word(
            "headline" if last.is_over else "going", session=last.number, began=began, blocks=len(last.blocks), now=now
        ),
        title=title,
        line=title,
        language=words.language,
        simulated=simulated,
        chapters=[
            Chapter(word("course"), (), "course", figure, word("caption")),
            Chapter(word("decisions"), [Table(columns, rows)], "decisions"),
            Chapter(word("rule"), [_rule(file, words), Text(word("assumed"))], "rule"),
        ],
    )


def _rule(file: AssistFile, words: AssistTexts) -> str:
    rule = file.sessions[-1].protocol.rule
    return words.page(
        "rule_text",
        lower=f"{100 * rule.lower_share:g}",
        raise_=f"{100 * rule.raise_share:g}",
        down=f"{rule.step_down_percent:g}",
        up=f"{rule.step_up_percent:g}",
        most=f"{rule.session_percent:g}",
        least=f"{rule.least_percent:g}",
    )
