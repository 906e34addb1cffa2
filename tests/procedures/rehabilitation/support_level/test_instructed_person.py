"""A person in a machine on drives hears each instruction: from the operator, or as a line to the simulated bench."""

import numpy as np

from exograv.procedures.bring_up.hands import BenchHands, KeyboardHands
from exograv.procedures.rehabilitation.support_level.instructed_person import BenchPerson, SpokenPerson, person_of

PLACE = np.array([0.1, -0.2, 0.3])


def test_an_operator_reads_target_and_support():
    said = list[str]()
    person = person_of(KeyboardHands(said.append), said.append)
    assert isinstance(person, SpokenPerson)
    person.rest(3.0, 0.4)
    person.attempt()
    person.reach(0, PLACE)
    assert said[0] == "Back to rest within 3 s. From now on: support 60 % (felt weight 40 %)."
    assert said[1] == "Get ready for the next target."
    assert said[2].startswith("Reach for target 1 within 6 s, and hold it: ")


def test_a_simulated_person_keeps_the_felt_level_until_it_changes():
    told = list[str]()
    person = person_of(BenchHands(told.append), lambda _line: None)
    assert isinstance(person, BenchPerson)
    person.rest()
    person.rest(3.0, 0.4)
    person.rest()
    person.reach(7, PLACE)
    person.attempt()
    assert told == [
        "rest 2.000000 0.000000",
        "rest 3.000000 0.400000",
        "rest 2.000000 0.400000",
        "reach 7 0.100000 -0.200000 0.300000",
        "attempt",
    ]
