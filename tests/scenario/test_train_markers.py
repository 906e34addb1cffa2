"""A recorder of Lab Streaming Layer gets every record of a session."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from tests.lsl_network import VARIABLE, own_network
from tests.scenario.test_train import command, short

from exograv.recording import read_recording

pylsl = pytest.importorskip("pylsl")

LISTENER = """
import json, sys, time, pylsl
resolver = pylsl.ContinuousResolver(prop="type", value="Markers")
print("looking", flush=True)
until = time.monotonic() + 120.0
while not (found := resolver.results()) and time.monotonic() < until:
    time.sleep(0.05)
inlet = pylsl.StreamInlet(found[0], recover=False)
print("hearing", flush=True)
try:
    while time.monotonic() < until:
        text, stamp = inlet.pull_sample(1.0)
        if text is not None:
            print(json.dumps([stamp, text[0]]), flush=True)
except pylsl.LostError:
    pass
"""


@pytest.mark.slow
def test_every_record_of_a_session_reaches_a_listener_once_and_in_its_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv(VARIABLE, own_network(tmp_path))
    listener = subprocess.Popen([sys.executable, "-c", LISTENER], stdout=subprocess.PIPE, text=True)
    try:
        assert listener.stdout is not None
        assert listener.stdout.readline() == "looking\n"
        words = "--protocol", str(short(tmp_path)), "--rig", "recupera_like_passive", "--lsl"
        subprocess.run(command(tmp_path, *words), check=True, capture_output=True)
        said, _ = listener.communicate(timeout=30.0)
    finally:
        listener.kill()
    heard = [json.loads(json.loads(line)[1]) for line in said.splitlines()[1:]]
    result = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    recording = read_recording(Path(result["recording"]))
    assert heard == [message["record"] for message in recording.messages("/task")]
