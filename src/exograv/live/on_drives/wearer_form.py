"""Form of the wearer of a machine on drives: from options, from a participant's file, or of a simulated wearer."""

from exograv.errors import ConfigError
from exograv.live.options import PersonForm
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription
from exograv.model.wearer_form import WearerForm
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.storage.participant_schema import StoredPerson


def form_of_wearer(
    description: RigDescription,
    person: PersonForm,
    is_simulated: bool,
    wearer: SimulatedWearer | None = None,
    known: StoredPerson | None = None,
) -> WearerForm:
    """Return body data of the wearer, and the lengths to which the machine is set.

    Args:
        description: Description of the machine.
        person: Form from the command line.
        is_simulated: True if the drives are simulated.
        wearer: Wearer of simulated drives, if the twin is installed.
        known: Person of a participant's file, whose form holds where the command line has none.

    Raises:
        ConfigError: The form is incomplete, or the wearer of simulated drives has a form already.
    """
    if wearer is not None:
        return _of_simulated(wearer, person)
    height_m, mass_kg, sex = person.height_m, person.mass_kg, person.sex
    if known is not None:
        height_m = known.height_m if height_m is None else height_m
        mass_kg = known.mass_kg if mass_kg is None else mass_kg
        sex = known.sex if sex is None else sex
    if height_m is None or mass_kg is None or sex is None:
        missing = [
            option
            for option, value in (("--body-height", height_m), ("--body-mass", mass_kg), ("--sex", sex))
            if value is None
        ]
        why = (
            "MuJoCo is not installed, so the wearer of the simulated drives is not known here. " if is_simulated else ""
        )
        raise ConfigError(f"{why}{', '.join(missing)} of the wearer: not given. Give all of them.")
    lengths = settings_of_lengths(description, person.lengths)
    if known is not None and not person.lengths:
        lengths = {name: known.lengths_m.get(name, length) for name, length in lengths.items()}
    return WearerForm(Body(height_m, mass_kg, sex, dict(lengths)), lengths)


def _of_simulated(wearer: SimulatedWearer, person: PersonForm) -> WearerForm:
    """Return the form of the simulated wearer: stature, mass, sex and measured segment lengths."""
    if person.lengths or person.height_m is not None or person.mass_kg is not None or person.sex is not None:
        raise ConfigError("--simulate draws its own wearer: leave out --body-height, --body-mass, --sex and --length.")
    return wearer.form
