"""Statistics of a study. The units of comparison are people, never touches as if each came from a person of its own."""
