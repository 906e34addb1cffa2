"""The drawing of the dummy arm in the documentation shows the numbers of its file."""

from tests.docs_scripts import docs_script

from exograv.procedures.acceptance.dummy import load_dummy


def test_the_drawing_is_that_of_the_shipped_file():
    script = docs_script("dummy_drawing")
    assert script.FILE.read_text(encoding="utf-8") == script.drawing(load_dummy())
    assert "0.601 kg at 80 mm" in script.drawing(load_dummy())
