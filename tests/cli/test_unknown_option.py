"""An option that a command does not have is answered with the one that was meant, or with the commands that have it."""

import pytest

from exograv.cli import ACTIONS, main
from exograv.cli.shell.unknown_option import advice


def test_an_option_with_one_dash_is_recognised():
    assert advice("demo", ["-seed", "3"], ACTIONS) == "An option has two dashes: did you mean --seed?"


def test_an_option_of_another_command_is_answered_with_the_commands_that_have_it():
    text = advice("rig new", ["x.urdf", "--gravity-level=0.2"], ACTIONS)
    assert text is not None
    assert text.startswith("`exograv rig new` has no option --gravity-level; these commands have it: demo,")


@pytest.mark.parametrize("words", [["--seed", "-1"], ["-h"], ["--help"], ["--nothing-like-this"]])
def test_values_help_and_words_like_no_option_get_no_advice(words: list[str]):
    assert advice("demo", words, ACTIONS) is None


def test_the_advice_stands_below_the_answer_of_the_parser(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr("sys.argv", ["exograv", "demo", "-seed", "3"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert capsys.readouterr().err.endswith("exograv: An option has two dashes: did you mean --seed?\n")
