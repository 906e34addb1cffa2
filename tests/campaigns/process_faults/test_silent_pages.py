"""Pages that are silent after the last of several strikes blame that strike, and no earlier one."""

from unittest.mock import Mock

import pytest

from exograv.campaigns.process_faults import flight
from exograv.campaigns.process_faults.cell import Cell, Process
from exograv.campaigns.process_faults.flight import Strike, _note_silent_pages
from exograv.campaigns.process_faults.struck_session import Session

CELLS = [Cell.of(f"{name}:floating") for name in ("console:kill", "lsl:kill", "console:memory", "ros2:kill")]


@pytest.mark.parametrize(("answer", "blamed"), [([True, False], [2]), ([False, True], [0]), ([False, False], [0, 2])])
def test_only_the_strike_before_the_silence_of_the_pages_is_blamed(
    answer: list[bool], blamed: list[int], monkeypatch: pytest.MonkeyPatch
):
    strikes, answers = [Strike() for _ in CELLS], iter(answer)
    monkeypatch.setattr(flight, "_awaited", lambda _session, _condition: next(answers))
    session = Mock(spec=Session, process=Mock(poll=lambda: None), notes=lambda _kind: [{"host": "here"}])
    for number, cell in enumerate(CELLS):
        if cell.process is Process.CONSOLE:
            _note_silent_pages(CELLS[:number], strikes, session)
        strikes[number].struck_t = float(number)
    _note_silent_pages(CELLS, strikes, session)
    assert [number for number, one in enumerate(strikes) if one.has_silent_pages] == blamed
