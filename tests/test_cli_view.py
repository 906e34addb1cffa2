"""`exograv view` shows any machine and recording, and says what is wrong with a target that it cannot show."""

import sys
from pathlib import Path

import pytest

from exograv import cli
from exograv.cli.recordings import mujoco_view
from exograv.model.description import rig_names

FLOATING = "examples/data/floating.mcap"


def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *words: str) -> tuple[int, str]:
    monkeypatch.setattr(sys, "argv", ["exograv", *words])
    status = 0
    try:
        cli.main()
    except SystemExit as end:
        status = int(end.code or 0)
    said = capsys.readouterr()
    return status, said.out + said.err


@pytest.mark.parametrize("target", [*rig_names(), "robots/recupera_like_7", FLOATING])
@pytest.mark.parametrize("words", [("view",), ("data", "view")])
def test_every_machine_and_a_recording_become_one_file(
    target: str, words: tuple[str, ...], tmp_path: Path, capsys, monkeypatch
):
    page = tmp_path / "new" / "page.html"
    assert run(capsys, monkeypatch, *words, target, "--page", str(page)) == (0, f"Page: {page}\n")
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("recupera_lik",), "Did you mean 'recupera_like'"),
        (("nowhere.mcap",), "nowhere.mcap cannot be read"),
        (("README.md",), "README.md"),
        (("recupera_like", "--side", "both"), "has no side 'both'"),
        (("recupera_like", "--height-m", "175"), "Was it given in cm"),
        (("recupera_like", "--rig", "agree_like"), "--rig goes with a recording"),
        ((FLOATING, "--mujoco"), "--mujoco shows machines only"),
        (("recupera_like", "--port", "70000", "--no-browser"), "--port is 70000"),
    ],
)
def test_a_wrong_input_ends_with_one_sentence_that_names_it(words: tuple[str, ...], told: str, capsys, monkeypatch):
    status, said = run(capsys, monkeypatch, "view", *words)
    assert status == 1
    assert told in said
    assert said.startswith("exograv: ")
    assert "Traceback" not in said


def test_mujocos_viewer_without_a_display_points_to_the_page(capsys, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    status, said = run(capsys, monkeypatch, "view", "recupera_like", "--mujoco")
    assert status == 1
    assert "no display" in said
    assert "Leave --mujoco out" in said


@pytest.mark.parametrize("rig", ["recupera_like_dual", "recupera_like_7"])
def test_mujocos_viewer_shows_the_twin_in_fastened_cuffs(rig: str):
    model, data = mujoco_view.shown_twin(rig, None)
    assert model.nbody > 10
    assert data.qpos.any()
