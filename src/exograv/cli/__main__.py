"""Entry point of `python -m exograv.cli`."""

from . import main

main()
