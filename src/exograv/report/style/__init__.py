"""The style that all figures and pages share."""
