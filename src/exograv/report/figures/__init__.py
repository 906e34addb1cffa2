"""One file a figure: what it draws from a recording, or None where the recording lacks it, and what one sees in it."""
