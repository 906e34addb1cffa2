"""Parts in C that all buses share: clock, measurement, units and limits of a machine of drives."""
