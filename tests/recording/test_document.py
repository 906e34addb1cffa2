"""The pages of the format and the schemas in a file agree with the table of channels."""

import json
import re
from pathlib import Path

from mcap.reader import make_reader

from exograv.recording import RecordingWriter
from exograv.recording.document import format_document
from exograv.recording.encoding import tick_definition
from exograv.recording.schema import CHANNELS, RESULT, SCHEMA_VERSION
from exograv.recording.writer import SYNC_EVERY_S

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "recording_format.md"


def test_the_page_states_the_version_and_the_interval_of_syncing():
    page = PAGE.read_text(encoding="utf-8")
    assert f"version {SCHEMA_VERSION} of this format" in page
    assert f"every {1e3 * SYNC_EVERY_S:.0f} ms" in page


def test_the_generated_page_has_every_field_of_every_channel_with_its_unit():
    document = format_document()
    for channel in CHANNELS.values():
        section = document.split(f"## `{channel.topic}`\n")[1].split("\n## ")[0]
        for field in channel.fields:
            assert re.search(rf"^\| `{field.name}` \| [^|]+ \| {re.escape(field.unit)} \|", section, flags=re.MULTILINE)


def test_every_field_states_its_unit():
    for channel in CHANNELS.values():
        assert all(field.unit for field in channel.fields)


def test_a_file_carries_the_schema_of_every_channel(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with RecordingWriter(path, ("elbow",), {}) as recording:
        recording.write("/result", 1.0, {})
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    schemas = {channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()}
    assert set(schemas) == set(CHANNELS)
    assert schemas["/tick"].data.decode() == tick_definition(1)
    assert set(json.loads(schemas["/result"].data)["properties"]) == {field.name for field in RESULT.fields}
