"""The page writer shows every part of a page, escapes texts, and gives the same text for the same page."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest
from matplotlib.figure import Figure

from exograv.errors import RecordingError
from exograv.report.style.figure_style import house_style, inline_svg, write_figure, write_picture
from exograv.report.style.page import (
    Bullets,
    Chapter,
    Folded,
    Page,
    Table,
    Text,
    Tile,
    markdown_text,
    page_text,
    write_page,
)

TABLE = Table(("name", "value"), [("a", "1"), ("b", "f" * 64)])
PAGE = Page(
    "A headline",
    [
        Chapter("Numbers", [Text("A note."), TABLE], "numbers"),
        Chapter("Words", [Bullets(["First.", "Second."]), Text("More", "heading"), "A paragraph."]),
    ],
    simulated="",
    title="A study",
    line="A study · CC0",
    facts=[("seed", "3")],
    tiles=[Tile("left over", "0.1 N·m", "", True), Tile("drift", "2°", "", False), Tile("weight", "1 kg")],
    lead=[Text("A warning.", "notice"), Text("A claim.", "strong")],
)
TEXTS = ("A headline", "Numbers", "A note.", "First.", "Second.", "More", "A paragraph.", "A warning.", "A claim.")


def figure() -> Figure:
    drawn = Figure(figsize=(2.0, 1.0))
    drawn.subplots().plot([1.0, 2.0], rasterized=True)
    return drawn


class Closed(HTMLParser):
    """Parser that fails if an element does not close."""

    def __init__(self):
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag != "meta":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_every_part_of_a_page_is_shown_in_elements_that_close():
    html = page_text(PAGE)
    assert all(text in html for text in (*TEXTS, "A study · CC0", "seed", "0.1 N·m"))
    parser = Closed()
    parser.feed(html)
    assert parser.open == []


def test_a_target_that_is_reached_is_told_in_words_and_not_by_colour_alone():
    html = page_text(PAGE)
    assert html.count("target reached") == html.count("target not reached") == 1


def test_a_screen_reader_finds_language_headings_and_the_name_of_a_figure():
    with house_style():
        html = page_text(replace(PAGE, language="de", chapters=[Chapter("Course", [TABLE], "course", figure(), "Up.")]))
    assert '<html lang="de">' in html
    assert html.count('<th scope="col">') == len(TABLE.columns)
    assert re.search(r'<figure role="group" aria-label="Course">.*<figcaption>Up.</figcaption>', html, re.DOTALL)


@pytest.mark.parametrize("field", ["headline", "title", "line", "simulated", "mark"])
def test_no_text_can_change_the_page(field: str):
    evil = '</style><script>alert("x")</script>\\'
    blocks = [evil, Bullets([evil]), Text(evil), Folded(evil, evil)]
    assert "<script>alert" not in page_text(replace(PAGE, **{field: evil}))
    assert "<script>alert" not in page_text(replace(PAGE, chapters=5 * [Chapter(evil, blocks, "a")]))


def test_a_long_page_has_a_table_of_contents_whose_links_lead_to_its_chapters():
    chapters = [
        Chapter(title, (), name) for title, name in (("One", "first"), *((f"Two: {k % 3}", "") for k in range(5)))
    ]
    html = page_text(replace(PAGE, chapters=chapters))
    links = re.findall(r'<a href="#([^"]+)">([^<]+)</a>', html)
    assert [title for _, title in links] == [chapter.title for chapter in chapters]
    assert len({anchor for anchor, _ in links}) == len(chapters)
    assert all(html.count(f'id="{anchor}"') == 1 for anchor, _ in links)


def test_a_short_page_has_no_table_of_contents():
    assert "<nav" not in page_text(PAGE)


def test_a_file_is_folded_until_it_is_opened():
    html = page_text(replace(PAGE, chapters=[Chapter("Files", [Folded("rig.toml", "a = 1\nb = 2")])]))
    assert "<details><summary>rig.toml</summary><pre>a = 1\nb = 2</pre></details>" in html


def test_a_figure_can_be_saved_as_picture_and_as_data():
    with house_style():
        html = page_text(replace(PAGE, chapters=[Chapter("Course", (), "course", figure(), "Up.")]))
    assert re.findall(r'data-kind="(\w+)"', html) == ["svg", "png"]
    link = re.search(r'href="data:text/csv;charset=utf-8,([^"]*)" download="course.csv"', html)
    assert link is not None
    assert "1,1,0,1\n1,1,1,2\n" in unquote(link[1])


def test_simulated_data_are_told_on_the_page_and_on_every_sheet_of_its_print():
    html = page_text(replace(PAGE, simulated="SIMULATED: nobody took part.", mark="SIMULATED"))
    assert "(simulated)</title>" in html
    assert "@top-right" in html
    assert html.count('<span class="note">SIMULATED</span>') == len(PAGE.chapters)
    assert "@top-right" not in page_text(PAGE)


def test_the_same_page_gives_the_same_text():
    with house_style():
        pages = [page_text(replace(PAGE, chapters=[Chapter("C", (), "c", figure(), "")])) for _ in range(2)]
    assert pages[0] == pages[1]


def test_markdown_has_the_same_texts_and_tables():
    text = markdown_text(PAGE, {"A curve": Path("curve.png")})
    assert all(one in text for one in TEXTS)
    assert "| name | value |\n| --- | --- |\n| a | 1 |" in text
    assert "![A curve](curve.png)" in text


def test_a_page_or_a_picture_that_cannot_be_written_is_a_readable_error(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="cannot be written"):
        write_page(tmp_path / "file" / "page.html", PAGE)
    with pytest.raises(RecordingError, match="cannot be written"):
        write_picture(tmp_path / "file" / "picture.png", figure)


def test_a_picture_has_no_date_in_it_and_the_format_of_its_ending(tmp_path: Path):
    svg, png = (write_picture(tmp_path / f"new/picture.{kind}", figure).read_bytes() for kind in ("svg", "png"))
    assert b"<svg" in svg
    assert b"<dc:date>" not in svg
    assert png.startswith(b"\x89PNG")
    assert write_picture(tmp_path / "new/picture.svg", figure).read_bytes() == svg


def test_dots_are_as_fine_in_the_file_as_on_the_page(tmp_path: Path):
    with house_style({"figure.dpi": 300}):
        drawn = figure()
        shown = inline_svg(drawn, "dots")
        path, _ = write_figure(tmp_path, "dots", drawn)
    images = [re.findall(r'<image[^>]* width="([\d.]+)"', text) for text in (shown, path.read_text(encoding="utf-8"))]
    assert images[0] == images[1]
    assert drawn.dpi == 300
