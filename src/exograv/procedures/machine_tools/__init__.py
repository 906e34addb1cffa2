"""Tools for the folder of a machine: check, questions, designed motion, export."""
