"""Commands for recordings and streams."""
