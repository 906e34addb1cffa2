"""A command says its usual duration at once, also before its first phase begins."""

import pytest

from exograv.cli.shell.progress import Lines


def test_a_command_whose_first_phase_is_late_states_its_duration_and_that_it_starts(capsys: pytest.CaptureFixture[str]):
    lines = Lines("It takes long.", 0.0, lambda: 0.5)
    lines.look()
    assert capsys.readouterr().err == "It takes long.\n[    0 s] Starting\n"
