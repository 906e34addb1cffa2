"""Simulated drives of `exograv dev drive-sim`, with the twin and its wearer behind them."""
