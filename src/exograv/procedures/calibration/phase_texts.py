"""Sentences about the phases of a calibration, for a terminal and for pages in several languages."""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from exograv import sentence

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "calibration.still": "Checking that the machine hangs still",
        "calibration.push": "Pushing {joint} ({number}/{of})",
        "calibration.sweep": "Calibrating the empty machine: {joint} ({number}/{of})",
        "calibration.weight": "Calibrating the empty machine: {joint} ({number}/{of}), {weight} kg",
        "calibration.hang": "Hanging {weight} kg",
        "calibration.cool": "Waiting until the motor of {motor} has cooled down from {celsius} °C",
        "calibration.friction": "Friction as it is now: {joint} ({number}/{of})",
        "calibration.motion": "Moving the empty machine as the motion file says",
        "calibration.home": "Moving the machine to its hanging posture",
    }
)
"""Texts in English by code, with placeholders."""

say = partial(sentence.say, SENTENCES)
