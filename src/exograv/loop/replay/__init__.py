"""`exograv data replay`: control and guard decide again on the measurements of a recording."""
