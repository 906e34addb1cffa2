"""The pages of operator, therapist, participant and viewer, and the server that lets nobody else in."""
