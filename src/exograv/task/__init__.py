"""Task of the participant: protocol, schedule, pace, pointing, judgement of touches. No clock, no device."""
