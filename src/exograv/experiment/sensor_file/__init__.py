"""Recorded acceleration of a real sensor, of any maker, as the data of an aircraft."""

from .load import SensorFile as SensorFile
from .load import load_flight as load_flight
from .series import Series as Series
