"""Commands for a machine: check, bring-up, calibration, self-test, live."""
