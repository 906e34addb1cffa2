"""`exograv replay`: control and guard decide once more on what a recording measured."""
