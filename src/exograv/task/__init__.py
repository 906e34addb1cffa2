"""What the participant does: protocol, schedule, pace, pointing, what is made of touches. No clock, no device."""
