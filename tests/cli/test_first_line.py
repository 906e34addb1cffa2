"""A command says its usual duration at once, also before its first phase begins."""

import pytest
from tests.test_cli_durations import FakeClock

from exograv.cli.shell.progress import Lines


def test_a_command_whose_first_phase_is_late_states_its_duration_and_that_it_starts(capsys: pytest.CaptureFixture[str]):
    clock = FakeClock()
    lines = Lines("It takes long.", 0.0, clock)
    lines.look()
    assert capsys.readouterr().err == ""
    clock.t = 5.5
    lines.look()
    assert capsys.readouterr().err == "It takes long.\n[    6 s] Starting\n"
