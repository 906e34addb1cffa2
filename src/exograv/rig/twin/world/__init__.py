"""Physics of the twin: MuJoCo scene, cuffs, forces, surroundings, water."""
