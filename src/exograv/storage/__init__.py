"""Files that are kept between days: calibrations, participants, passes of the self-test, checkpoints."""
