"""One file format for every run: written while it happens, read by anyone."""

from .writer import RecordingWriter as RecordingWriter
