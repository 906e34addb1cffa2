"""Simulated amplifier with EEG and EMG electrodes on the simulated participant, which publishes streams of LSL."""
