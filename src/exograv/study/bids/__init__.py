"""Export of a study in the Brain Imaging Data Structure (BIDS 1.11), which programs of other laboratories can read."""
