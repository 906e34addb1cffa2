"""Recordings: one file format for every run, written during the run, with writer and reader."""

from .log import MotionLog as MotionLog
from .log import read_log as read_log
from .on_demand import open_recording as open_recording
from .pieces import RecordingPass as RecordingPass
from .pieces import read_topics as read_topics
from .pieces import tick_pieces as tick_pieces
from .reader import Recording as Recording
from .reader import read_recording as read_recording
from .tick_row import TickRow as TickRow
from .writer import RecordingWriter as RecordingWriter
