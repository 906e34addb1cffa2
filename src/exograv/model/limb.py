"""Names of the joints, freedoms and bodies of one arm, and their indices in the lists of all arms of the machine."""

from dataclasses import dataclass

from .rig_settings import FREEDOMS_OF_ARM, HAND_APART, ArmKind, ArmSide

FREEDOMS = ("flexion", "abduction", "rotation", "elbow", "forearm_roll", "wrist_flexion", "wrist_deviation")
"""Freedoms of one arm, in order; a machine that moves fewer joints has the first ones. The order at the shoulder is
that of Rajagopal 2016. Positive directions: forward, outward, inward, flexion of the elbow, pronation, towards the
palm, towards the thumb. The shift of the shoulder's centre depends on them."""

SEGMENTS = ("upper_arm", "forearm", "hand")
"""Bodies of one arm; if the wrist does not move, the hand belongs to the forearm."""


@dataclass(frozen=True)
class Limb:
    """Indices of one arm in the tree; its joints, freedoms and segments are contiguous."""

    side: ArmSide
    kind: ArmKind
    number: int
    """Number of the arm: 0, or 1 for the second arm."""

    prefix: str
    """Prefix of the arm's names; empty if there is only one arm."""

    @property
    def n_freedoms(self) -> int:
        """Number of freedoms, four to seven."""
        return FREEDOMS_OF_ARM[self.kind]

    @property
    def freedoms(self) -> slice:
        """Slice of the arm among all freedoms."""
        return slice(self.number * self.n_freedoms, (self.number + 1) * self.n_freedoms)

    @property
    def root(self) -> int:
        """Index of the arm's first joint in the tree."""
        return self.number * (self.n_freedoms + 2)

    @property
    def shift(self) -> int:
        """Index of the joint that shifts the shoulder's centre."""
        return self.root

    @property
    def lengthening(self) -> int:
        """Index of the joint that lengthens the upper arm beyond its measured length."""
        return self.root + 4

    @property
    def elbow(self) -> int:
        """Index of the elbow's joint."""
        return self.root + 5

    @property
    def joints(self) -> list[int]:
        """Indices of the joints that are the freedoms."""
        return [self.root + i for i in (1, 2, 3, *range(5, self.n_freedoms + 2))]

    @property
    def bodies(self) -> dict[str, int]:
        """Indices of the segments' bodies in the tree; the other bodies are massless."""
        # The forearm's body is the one after the roll joint: roll turns the whole forearm.
        bodies = {"upper_arm": self.root + 3, "forearm": self.root + (5 if self.kind == "shoulder_elbow" else 6)}
        return bodies | ({"hand": self.root + self.n_freedoms + 1} if self.kind in HAND_APART else {})
