"""Entry point of `python -m exograv`."""

from exograv.cli import main

main()
