"""Recordings become findings; runs on any laptop, without the model or the twin."""

from .report import write_report as write_report
from .summary import write_summary_picture as write_summary_picture
