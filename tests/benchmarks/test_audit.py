"""The audit reports what was answered: an advisory with its remedy, and a package without an answer as not audited."""

from pathlib import Path
from typing import Any

import pytest

import audit

GOOD, BAD, OTHER = ("good", "1.0"), ("bad", "2.0"), ("other", "3.0")
ADVISORY: dict[str, Any] = {"id": "PYSEC-1", "fix_versions": ["2.1"], "description": "Reads too much.\nMore."}
REPORT = {
    "dependencies": [
        {"name": "good", "version": "1.0", "vulns": []},
        {"name": "bad", "version": "2.0", "vulns": [ADVISORY]},
        {"name": "other", "skip_reason": "not found"},
    ]
}


def test_a_package_that_a_service_skips_has_no_answer():
    assert audit.answers(REPORT) == {GOOD: [], BAD: [ADVISORY]}


def test_the_summary_names_each_advisory_with_its_remedy_and_each_package_without_an_answer():
    lines = audit.summary({GOOD, BAD, OTHER}, audit.answers(REPORT))
    assert lines == [
        "Advisories: 1 for 2 audited packages.",
        "  bad 2.0: PYSEC-1, mended in 2.1: Reads too much.",
        "  No service has answered for 1 packages; these are not audited: other.",
    ]


def test_without_any_answer_the_audit_does_not_say_that_there_are_no_advisories():
    assert "unknown" in audit.summary({GOOD, BAD}, {})[0]


def test_two_versions_of_a_package_are_asked_for_apart():
    assert audit.parts([("a", "1"), ("b", "1"), ("a", "2")]) == [[("a", "1"), ("b", "1")], [("a", "2")]]


def test_an_audit_whose_tools_fail_ends_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setattr(audit, "OUT", tmp_path)
    monkeypatch.setattr(audit, "_run", lambda command, limit_s: False)
    audit.main()
    said = capsys.readouterr().out
    assert "no bill of materials, because the tool failed" in said
    assert "nothing was audited" in said
