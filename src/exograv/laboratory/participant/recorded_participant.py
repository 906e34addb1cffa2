"""Settings of a simulated room and its participant, as a recording states them."""

from exograv.results import JsonObject
from exograv.rig.twin.world.surroundings import Surroundings

from .habits import Habits, register
from .touch_screen import SimulatedRoom


def recorded_participant(room: SimulatedRoom, surroundings: Surroundings, habits: Habits) -> JsonObject:
    """Return the settings by name. A recording with them is of a virtual participant."""
    return {
        "room": room,
        "surroundings": {
            "screen_centre_m": surroundings.screen_centre.tolist(),
            "screen_tilt_rad": surroundings.screen_tilt,
            "support_z_m": surroundings.support_z,
        },
        "participant_model": habits,
        "participant_constants": register(habits),
    }
