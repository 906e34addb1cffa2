"""Names of the joints, freedoms and bodies of one arm, and their indices in the lists of all arms of the machine."""

from dataclasses import dataclass

from .rig_settings import FREEDOMS_OF_ARM, HAND_APART, ArmKind, ArmSide

FREEDOMS = ("flexion", "abduction", "rotation", "elbow", "forearm_roll", "wrist_flexion", "wrist_deviation")
"""Freedoms of one arm, in order; a machine that moves fewer joints has the first ones. The order at the shoulder is
that of Rajagopal 2016. Positive directions: forward, outward, inward, flexion of the elbow, pronation, towards the
palm, towards the thumb. The shift of the shoulder's centre depends on them."""

SHIFTS = 3
"""Number of joints of one arm that shift its shoulder's centre, one per direction."""

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
        return self.number * (self.n_freedoms + SHIFTS + 1)

    @property
    def shifts(self) -> slice:
        """Joints that shift the shoulder's centre: up and medially, forward, up and laterally."""
        return slice(self.root, self.root + SHIFTS)

    @property
    def lengthening(self) -> int:
        """Index of the joint that lengthens the upper arm beyond its measured length."""
        return self.root + SHIFTS + 3

    @property
    def elbow(self) -> int:
        """Index of the elbow's joint."""
        return self.root + SHIFTS + 4

    @property
    def joints(self) -> list[int]:
        """Indices of the joints that are the freedoms."""
        return [self.root + SHIFTS + i for i in (0, 1, 2, *range(4, self.n_freedoms + 1))]

    @property
    def bodies(self) -> dict[str, int]:
        """Indices of the segments' bodies in the tree; the other bodies are massless."""
        # The forearm's body is the one after the roll joint: roll turns the whole forearm.
        bodies = {"upper_arm": self.root + SHIFTS + 2, "forearm": self.elbow + (self.kind != "shoulder_elbow")}
        return bodies | ({"hand": self.root + SHIFTS + self.n_freedoms} if self.kind in HAND_APART else {})
