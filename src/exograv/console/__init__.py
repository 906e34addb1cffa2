"""Web pages of operator, therapist, participant and viewer, and their server, which admits invited people only."""
