"""Options and terminal output that the commands share."""
