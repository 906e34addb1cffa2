"""Common style of all figures and pages."""
