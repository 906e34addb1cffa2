"""Sessions with a participant: one file per kind of session, which connects its parts."""
