"""Files kept between days: calibrations, participants, self-test passes, bring-up sheets, checkpoints."""
