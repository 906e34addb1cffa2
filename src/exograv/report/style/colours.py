"""Colours of all figures."""

# Palette of Okabe and Ito, which colour-blind readers can distinguish.
BLUE, ORANGE, GREEN, RED, PINK, SKY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"
INK, GREY, PALE = "#22303C", "#8B96A1", "#E3E8EC"

JOINT_COLOURS = (BLUE, RED, PINK, GREEN, ORANGE, SKY, INK)
