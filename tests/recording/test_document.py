"""The document of the format and the schemas in a file agree with the table."""

import json
from pathlib import Path

from mcap.reader import make_reader

from exograv.recording import RecordingWriter
from exograv.recording.document import format_document
from exograv.recording.encoding import tick_definition
from exograv.recording.schema import CHANNELS, RESULT

DOCUMENT = Path(__file__).parents[2] / "docs" / "reference" / "recording_format.md"


def test_the_document_agrees_with_the_table():
    assert DOCUMENT.read_text(encoding="utf-8") == format_document(), (
        "Renew it: python -m exograv.recording.document > docs/reference/recording_format.md"
    )


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
