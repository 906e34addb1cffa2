"""Sessions of assist-as-needed with a virtual person."""
