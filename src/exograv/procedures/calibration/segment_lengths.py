"""Segment lengths that an adjustable machine is set to."""

from exograv.errors import ConfigError
from exograv.model.description import RigDescription


def settings_of_lengths(description: RigDescription, given: tuple[str, ...]) -> dict[str, float]:
    """Length of each adjustable segment [m]: as given by SEGMENT=METRES, otherwise nominal.

    Raises:
        ConfigError: The segment does not exist, the value is no number, or the length is outside the allowed range.
    """
    adjustments = {one.segment: one for one in description.settings.adjustments}
    lengths = {segment: one.nominal_m for segment, one in adjustments.items()}
    for text in given:
        segment, _, value = text.partition("=")
        if segment not in adjustments:
            known = ", ".join(adjustments) or "none"
            raise ConfigError(
                f"--length is '{text}'; {description.name} can be set at: {known}. Give SEGMENT=METRES, such as "
                "forearm=0.26."
            )
        one = adjustments[segment]
        try:
            lengths[segment] = float(value)
        except ValueError:
            raise ConfigError(f"--length is '{text}'; give SEGMENT=METRES, such as {segment}=0.26.") from None
        if not one.min_m <= lengths[segment] <= one.max_m:
            raise ConfigError(f"--length is '{text}'; {segment} can be set from {one.min_m:g} to {one.max_m:g} m.")
    return lengths
