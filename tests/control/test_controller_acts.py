"""Commands to a controller and the recording format name the same values."""

from dataclasses import fields

import pytest

from exograv.control.controller_acts import ACTS
from exograv.recording import schema


@pytest.mark.parametrize("act", ACTS)
def test_each_value_of_a_command_has_a_field_in_the_recording_format(act: str):
    known = {field.name for field in schema.CHANNELS["/control"].fields}
    assert {value.name for value in fields(ACTS[act])} <= known
