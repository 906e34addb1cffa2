"""One file format for every run: written while it happens, read by anyone."""

from .log import MotionLog as MotionLog
from .log import read_log as read_log
from .reader import Recording as Recording
from .reader import read_recording as read_recording
from .writer import RecordingWriter as RecordingWriter
