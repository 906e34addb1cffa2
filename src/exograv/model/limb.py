"""One arm's joints, freedoms and bodies, by name and by their place among those of all arms."""

from dataclasses import dataclass

from .rig_settings import FREEDOMS_OF_ARM, HAND_APART, ArmKind, ArmSide

FREEDOMS = ("flexion", "abduction", "rotation", "elbow", "forearm_roll", "wrist_flexion", "wrist_deviation")
"""Of one arm, in order; a kind that a machine moves less of has the first few. Order of the shoulder's after Rajagopal
2016. Positive: forward, outward, inward, bending; pronation, towards the palm, towards the thumb. The shift of the
shoulder's centre follows from them."""

SEGMENTS = ("upper_arm", "forearm", "hand")
"""Bodies of one arm; where the wrist does not move the hand belongs to the forearm."""


@dataclass(frozen=True)
class Limb:
    """One arm's place in the tree: its joints, freedoms and segments stand together."""

    side: ArmSide
    kind: ArmKind
    number: int
    """0, or 1 for the second arm."""

    prefix: str
    """Of its names: empty where there is one arm."""

    @property
    def n_freedoms(self) -> int:
        """Four to seven."""
        return FREEDOMS_OF_ARM[self.kind]

    @property
    def freedoms(self) -> slice:
        """Place among all freedoms."""
        return slice(self.number * self.n_freedoms, (self.number + 1) * self.n_freedoms)

    @property
    def root(self) -> int:
        """Index of its first joint in the tree."""
        return self.number * (self.n_freedoms + 2)

    @property
    def shift(self) -> int:
        """Joint that shifts the shoulder's centre."""
        return self.root

    @property
    def lengthening(self) -> int:
        """Joint that sets the upper arm longer than it was measured."""
        return self.root + 4

    @property
    def joints(self) -> list[int]:
        """Joints that are the freedoms."""
        return [self.root + i for i in (1, 2, 3, *range(5, self.n_freedoms + 2))]

    @property
    def bodies(self) -> dict[str, int]:
        """Index of the body in the tree that is each segment; the others are massless."""
        # The whole forearm turns with its roll.
        bodies = {"upper_arm": self.root + 3, "forearm": self.root + (5 if self.kind == "shoulder_elbow" else 6)}
        return bodies | ({"hand": self.root + self.n_freedoms + 1} if self.kind in HAND_APART else {})
