"""The options and the terminal output that commands share."""
