"""A study as a data set of the Brain Imaging Data Structure (BIDS 1.11), which other laboratories' programs read."""
