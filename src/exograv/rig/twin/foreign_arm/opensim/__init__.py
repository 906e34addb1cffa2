"""Arm models of OpenSim (`.osim`, layouts 3.x and 4.x), converted to MuJoCo's specification."""
