"""What is measured of a touch, a window, a session and a person: one table of names, and how each is computed."""
