"""The protocol of an acceptance is sealed, belongs to one machine, and has a page to sign."""

from datetime import datetime
from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig
from exograv.storage.acceptance_protocol import (
    FILE,
    PAGE,
    SIMULATED,
    AcceptanceKey,
    AcceptanceProtocol,
    AcceptanceRecord,
    protocol_part,
    read_protocol_of,
    write_protocol,
)
from exograv.storage.calibration_file import identity_of
from exograv.storage.self_test_step import Step

RIG, SERIAL, AGAIN = load_rig("recupera_like"), "A-1", "Accept it again."
NOW = datetime.fromisoformat("2026-01-02T03:04:05+01:00")


def protocol(is_simulated: bool = False) -> AcceptanceProtocol:
    steps = [
        Step("hand at most", True, 0.61, 1.0, "m/s"),
        Step("drives at the end", False, "elbow", "off", "", "Look."),
    ]
    key = AcceptanceKey(
        drives_sha256="a",
        calibration_sha256="b",
        dummy="dummy A",
        dummy_sha256="c",
        code_sha256="d",
        is_simulated=is_simulated,
    )
    done = AcceptanceRecord(by="ab", begun=NOW, written=NOW, state="failed", aborted_at="", versions={"exograv": "0"})
    parts = [protocol_part("operator's stop", NOW, 12.3, "out/acceptance", steps)]
    return AcceptanceProtocol(identity=identity_of(RIG, SERIAL), key=key, done=done, parts=parts)


def test_a_protocol_is_read_as_it_was_written(tmp_path: Path):
    written = write_protocol(tmp_path, protocol())
    assert read_protocol_of(tmp_path / FILE, RIG, SERIAL, AGAIN) == written
    assert not written.parts[0].passed


def test_an_edited_protocol_is_refused(tmp_path: Path):
    write_protocol(tmp_path, protocol())
    path = tmp_path / FILE
    path.write_text(path.read_text(encoding="utf-8").replace("passed = false", "passed = true"), encoding="utf-8")
    with pytest.raises(ConfigError, match="damaged or edited"):
        read_protocol_of(path, RIG, SERIAL, AGAIN)


@pytest.mark.parametrize(("serial", "why"), [("A-2", "A-1"), (SERIAL, "is missing")])
def test_a_protocol_of_another_machine_or_none_is_refused(tmp_path: Path, serial: str, why: str):
    if serial != SERIAL:
        write_protocol(tmp_path, protocol())
    with pytest.raises(ConfigError, match=why):
        read_protocol_of(tmp_path / FILE, RIG, serial, AGAIN)


@pytest.mark.parametrize("is_simulated", [True, False])
def test_the_page_has_every_step_and_says_if_it_is_simulated(tmp_path: Path, is_simulated: bool):
    write_protocol(tmp_path, protocol(is_simulated))
    page = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "| hand at most | 0.61 | 1 m/s | passed |" in page
    assert "| drives at the end | elbow | off | FAILED |" in page
    assert "signature: ___" in page
    assert (SIMULATED in page) == is_simulated
