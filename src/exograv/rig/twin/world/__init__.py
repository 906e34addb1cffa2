"""The twin's physics: MuJoCo scene, cuffs, forces, surroundings, water."""
