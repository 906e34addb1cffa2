"""Command `exograv dev amplifier`."""

from typing import TYPE_CHECKING

from exograv.laboratory.options import AmplifierOptions

if TYPE_CHECKING:
    from exograv.laboratory.amplifier.amplifier_command import AmplifierResult


def run_amplifier_command(options: AmplifierOptions) -> "AmplifierResult":
    """Publish simulated EEG and EMG over Lab Streaming Layer, with electrodes on the participant of `dev stimulus`."""
    from exograv.laboratory.amplifier.amplifier_command import run_amplifier

    result = run_amplifier(options, lambda line: print(line, flush=True))
    sent = ", ".join(f"{count} of {name}" for name, count in result.samples.items())
    print(f"Samples sent: {sent}. Pulses: {len(result.pulses)}.", flush=True)
    return result
