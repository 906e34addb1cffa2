"""The recursive information filter."""
