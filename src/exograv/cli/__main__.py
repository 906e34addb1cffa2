"""`python -m exograv.cli`."""

from exograv.cli import main

main()
