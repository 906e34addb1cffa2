"""Search for the needed support with a virtual weak person."""
