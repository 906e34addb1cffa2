"""Identify one wearer of the benchmark in closed loop, without shape checks: print the outcome.

Arguments: kind of drive, number of the wearer, duration [s].
"""

import json
import sys

from exograv.campaigns.benchmark_identification.cases import population
from exograv.campaigns.benchmark_identification.streams import calibrate


def main(profile, number: str, seconds: str) -> None:
    """Calibrate the machine, put the wearer on, and identify the arm."""
    case = population(profile, 2, int(number) + 1, 0)[int(number)]
    worn = calibrate(case, lambda *_: None).worn(case, case.laboratory(), lambda *_: None)
    found = worn.identify(worn.identifier("recursive", listener=lambda *_: None), float(seconds))
    print(json.dumps(found.outcome.name))


if __name__ == "__main__":
    main(*sys.argv[1:])
