"""The recorder process and its supervisor."""
