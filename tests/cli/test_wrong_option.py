"""A word that a command cannot use is answered in one sentence: the word, what is allowed, and the next step."""

from pathlib import Path

import pytest

from exograv.cli import ACTIONS, main, parsed
from exograv.cli.shell.wrong_option import missing_words, wrong_word

DEMO_HELP = "`exograv demo --help` shows all options."


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("--seed abc", "--seed is 'abc'; allowed: an integer, 0 and above."),
        ("--seed=1.5", "--seed is '1.5'; allowed: an integer, 0 and above."),
        ("--level two", "--level is 'two'; allowed: an integer, 0 (none) to 4 (a bad day)."),
        ("--seconds 1,5", "--seconds is '1,5'; allowed: a number, 5 to 600 s of motion."),
        ("--motion foo", "--motion is 'foo'; allowed: designed, adaptive, fourier, fixed."),
        ("--side up", "--side is 'up'; allowed: right, left, both."),
        ("--seed", "--seed has no value; allowed: an integer, 0 and above."),
        ("--seed --level 3", "--seed has no value; allowed: an integer, 0 and above."),
        ("--realtime=yes", "--realtime is 'yes', but it takes no value: give --realtime alone, or leave it out."),
        ("recupera_like more", "'more' is one word too many: `exograv demo` takes RIG."),
        ("--sed 3", "`exograv demo` has no option --sed. Did you mean --seed?"),
        ("-seed 3", "`exograv demo` has no option -seed. An option has two dashes: did you mean --seed?"),
        ("--nothing-like-this", "`exograv demo` has no option --nothing-like-this."),
    ],
)
def test_a_wrong_word_is_named_with_what_is_allowed_and_the_next_step(words: str, sentence: str):
    assert wrong_word("demo", words.split(), ACTIONS) == f"{sentence} {DEMO_HELP}"


def test_an_option_of_another_command_is_answered_with_the_commands_that_have_it():
    text = wrong_word("rig new", ["x.urdf", "--gravity-level=0.2"], ACTIONS)
    assert text is not None
    assert text.startswith("`exograv rig new` has no option --gravity-level. These commands have it: demo,")


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("demo", "--seed -1"),
        ("demo", "-h"),
        ("demo", "recupera_like --gravity_level 0.5 --no-realtime --seed=3"),
        ("run console", "--aircraft 1 2"),
        ("rig test", "--wrong-sign a --wrong-sign b --simulate"),
        ("study add", "s one.csv two.csv"),
        ("study simulate", "--constant width=0.1 gain=2 --seed 3"),
    ],
)
def test_words_that_can_be_used_are_not_called_wrong(path: str, words: str):
    assert wrong_word(path, words.split(), ACTIONS) is None


def test_absent_options_are_named_with_their_meaning():
    text = missing_words("arm identify-log", ["a.csv", "--urdf", "r.urdf", "--gains", "1,2"], ACTIONS)
    assert text is not None
    assert text.startswith("`exograv arm identify-log` needs --unloaded (Logs of the same robot without the payload")
    assert "--urdf" not in text
    assert missing_words("demo", [], ACTIONS) is None


def test_the_command_line_prints_only_that_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr("sys.argv", ["exograv", "demo", "--seed", "abc"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert capsys.readouterr().err == f"exograv: --seed is 'abc'; allowed: an integer, 0 and above. {DEMO_HELP}\n"


def test_what_a_settings_file_gives_is_not_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "s.toml"
    file.write_text('[arm.identify-log]\nurdf = "r.urdf"\n')
    with pytest.raises(SystemExit):
        parsed("arm identify-log", ["--settings", str(file), "a.csv"])
    told = capsys.readouterr().err
    assert told.startswith("exograv: `exograv arm identify-log` needs --unloaded")
    assert "--urdf" not in told
