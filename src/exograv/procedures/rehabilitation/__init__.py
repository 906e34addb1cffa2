"""Procedures for weak arms: support level, assist as needed, teach, repeat and mirror."""
