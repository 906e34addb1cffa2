"""Content and kinematics of OpenSim files (`.osim`, layouts 3.x and 4.x)."""
