"""Hidden machines: recordings of machines that no author of an estimator has seen, and the judgement of a fit.

    python benchmarks/hidden_machines.py record out/hidden --names a b c                # draw, drive, record
    python benchmarks/hidden_machines.py record out/hidden --names a --seed 7 --disclose out/truth
    python benchmarks/hidden_machines.py plain out/hidden/a.mcap out/plain/a.json      # plain least squares, nominal
    python benchmarks/hidden_machines.py fitted out/twin/a/recupera_like out/twin/a.json FIT.json   # a twin
    python benchmarks/hidden_machines.py judge out/truth/a.json FIT.json out/hidden/a_held_out.mcap
    python benchmarks/hidden_machines.py minutes out/hidden --names a --truth out/truth --minutes 1 3 10
    python benchmarks/hidden_machines.py effort out/hidden/a_600s out/truth/a.json out/hidden/a.mcap   # DAM/GCM
    python benchmarks/hidden_machines.py reactions out/hidden/a_600s out/truth/a.json out/hidden/a.mcap   # to faults
    python benchmarks/hidden_machines.py calibrate out/hidden/a_600s out/truth/a.json out/hidden/a.mcap   # by prior
    python benchmarks/hidden_machines.py further out/hidden --names a --truth out/truth --minutes 1   # designed motion
    python benchmarks/hidden_machines.py record out/hidden --names a --disclose out/truth --pulled   # also by hand
    python benchmarks/hidden_machines.py pulled out/hidden --names a --truth out/truth   # gains by force sensor
    python benchmarks/hidden_machines.py form                                          # the form of FIT.json

A machine is a set of ordinary differential equations of its own (`hidden/engine.c`): nothing of `exograv.dynamics` or
of the twin is in it. It has the geometry of `robots/recupera_like/right.urdf`; all else is drawn. exograv's own loop,
guard and controller of the empty machine drive it. The seed comes from the operating system unless `--seed` names one.
The true values are written only with `--disclose`. With `--pulled` the machine also flies its plan without weights, and
then slowly through the workspace: in NAME_unpulled.csv by itself, in NAME_pulled.csv while an operator pulls by hand at
the calibration mount. There the columns force_x to moment_z are force [N] and moment [N·m] of the hand on the machine,
as a six-axis sensor with noise, bias and scale error measures them at the origin of the mount's frame, in its axes.
"""

import argparse
import os
from pathlib import Path

import numpy as np

from hidden.calibration import compare_priors
from hidden.draw import Hidden, Stream, draw
from hidden.effort import compare_effort
from hidden.fitted import write_fitted
from hidden.further import further, further_table
from hidden.geometry import Geometry, read_geometry
from hidden.judge import FORM, judge, judgement_text
from hidden.parts import fit_part
from hidden.plain_fit import public_notes, write_nominal, write_plain
from hidden.pulled import PULLED, UNPULLED, print_gains
from hidden.reactions import FAULTS, compare_reactions
from hidden.session import RIG, Session

ROOT = Path(__file__).parents[1]
HELD_OUT_S = 60.0
"""Duration of the held-out motion [s]."""
SEED_BYTES = 7
"""Length of a seed from the operating system: JSON keeps it exactly."""


def record(options: argparse.Namespace) -> None:
    """Draw machines, drive them and write their recordings."""
    geometry = read_geometry(ROOT / "robots" / RIG / "right.urdf")
    for name in options.names:
        seed = int.from_bytes(os.urandom(SEED_BYTES), "little") if options.seed is None else options.seed
        session = Session(geometry, lambda gain, seed=seed: draw(geometry, gain, seed))
        motion = np.random.default_rng((seed, Stream.MOTION))
        for suffix, held_out_s in (("", None), ("_held_out", HELD_OUT_S)):
            path = options.folder / f"{name}{suffix}.mcap"
            notes = session.record(path, motion, held_out_s, options.plans)
            print(f"{path}: {session.rig.t:.1f} s on the machine's clock at the end, {len(notes.entries)} notes")
        if options.pulled:
            record_pulled(session, options.folder, name, seed)
        if options.disclose is not None:
            session.hidden.disclose(options.disclose / f"{name}.json", session.mean_gain)


def record_pulled(session: Session, folder: Path, name: str, seed: int) -> None:
    """Write the recordings without weights: one that no one pulls, and one that an operator pulls."""
    streams = {UNPULLED: (Stream.UNPULLED_MOTION, None), PULLED: (Stream.PULLED_MOTION, Stream.OPERATOR)}
    for suffix, (motion, operator) in streams.items():
        path = folder / f"{name}{suffix}.mcap"
        pulls = None if operator is None else np.random.default_rng((seed, operator))
        session.record_pulled(path, np.random.default_rng((seed, motion)), pulls)
        print(f"{path.with_suffix('.csv')}: {session.rig.t:.1f} s on the machine's clock at the end")


def plain(options: argparse.Namespace) -> None:
    """Write the fit of plain least squares, and the nominal machine, in the form that `judge` reads."""
    geometry = read_geometry(ROOT / "robots" / RIG / "right.urdf")
    held_out = options.recording.with_stem(f"{options.recording.stem}_held_out")
    write_plain(geometry, options.recording, held_out, options.fit)
    write_nominal(geometry, held_out, options.fit.with_stem(f"{options.fit.stem}_nominal"))


def judged(options: argparse.Namespace) -> None:
    """Print the errors of a fit against the disclosed machine."""
    print(judgement_text(judge(Hidden.disclosed(options.truth), options.fit, options.held_out)))


def minutes(options: argparse.Namespace) -> None:
    """Fit parts of each recording, and print the errors of the fits by minutes of recording."""
    print("| machine | min | friction % | rotor % | axis % | gain % | delay ms | over noise |")
    print("|---|---|---|---|---|---|---|---|")
    for name in options.names:
        hidden = Hidden.disclosed(options.truth / f"{name}.json")
        for length in options.minutes:
            part = fit_part(options.folder, name, 60.0 * length)
            found = judge(hidden, part.fit, options.folder / f"{name}_held_out.mcap")
            columns = (found.friction_error, found.rotor_error, found.axis_error, found.gain_error)
            worst = [f"{100.0 * np.abs(one).max():.1f}" for one in columns]
            cells = [*worst, f"{found.delay_error_ms:.2f}", f"{(part.held_out_Nm / found.noise).max():.2f}"]
            print(f"| {name} | {part.seconds / 60.0:.1f} | {' | '.join(cells)} |", flush=True)


def effort(options: argparse.Namespace) -> None:
    """Print DAM/GCM of wearers in the hidden machine and in its fitted twin."""
    compare_effort(options.machine, *_truth(options), options.wearers, options.draws)


def calibrated(options: argparse.Namespace) -> None:
    """Calibrate the hidden machine with its drawing and with its twin as prior."""
    compare_priors(options.machine, *_truth(options))


def reactions(options: argparse.Namespace) -> None:
    """Print reactions to faults in the hidden machine and in its fitted twin."""
    flown = (options.wearer, options.draws, options.flights, options.faults)
    compare_reactions(options.machine, *_truth(options), *flown)


def further_motion(options: argparse.Namespace) -> None:
    """Fly the motion that a fit designs, and print predicted and reached intervals."""
    geometry = read_geometry(ROOT / "robots" / RIG / "right.urdf")
    for name in options.names:
        hidden = Hidden.disclosed(options.truth / f"{name}.json")
        rows = list(further(options.folder, name, 60.0 * options.minutes, hidden, geometry))
        print(f"machine {name}\n{further_table(rows)}", flush=True)


def pulled(options: argparse.Namespace) -> None:
    """Fit the recordings of `record --pulled` and the one with a weight, and print the errors of their gains."""
    for name in options.names:
        print_gains(options.folder, name, options.truth / f"{name}.json")


def _truth(options: argparse.Namespace) -> tuple[Hidden, Geometry, float]:
    """Disclosed machine, its geometry, and the time at which its recording ended [s]: it runs on from there."""
    geometry = read_geometry(ROOT / "robots" / RIG / "right.urdf")
    return Hidden.disclosed(options.truth), geometry, float(public_notes(options.recording)[-1]["t"])


def _add_flights(parts: argparse._SubParsersAction) -> None:
    """Add the parts that run the machine on from its recording."""
    for run, name in ((effort, "effort"), (reactions, "reactions"), (calibrated, "calibrate")):
        one = parts.add_parser(name, help=run.__doc__)
        one.add_argument("machine", type=Path, help="folder of the machine with twin.toml")
        one.add_argument("truth", type=Path, help="file of --disclose")
        one.add_argument("recording", type=Path, help="recording of the fit: the machine runs on from its end")
        one.set_defaults(run=run)
        if run is calibrated:
            continue
        one.add_argument("--draws", type=int, default=2, help="draws from the posterior for each wearer")
        if run is effort:
            one.add_argument("--wearers", type=int, default=5)
        else:
            one.add_argument("--wearer", type=int, default=0, help="seed of the wearer")
            one.add_argument("--flights", type=int, default=6, help="flights of each fault")
            one.add_argument("--faults", nargs="+", choices=FAULTS, default=list(FAULTS))


def main() -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(required=True)
    one = parts.add_parser("record", help=record.__doc__)
    one.add_argument("folder", type=Path)
    one.add_argument("--names", nargs="+", default=["machine"])
    one.add_argument("--seed", type=int, help="seed of the draw; of the operating system if absent")
    one.add_argument("--plans", type=int, default=1, help="number of times that the plan of about 4 min is flown")
    one.add_argument("--disclose", type=Path, help="folder for the true values; not written if absent")
    one.add_argument(
        "--pulled", action="store_true", help="add recordings without weights: unpulled, and pulled by hand"
    )
    one.set_defaults(run=record)
    one = parts.add_parser("plain", help=plain.__doc__)
    one.add_argument("recording", type=Path, help="recording, with its held-out one beside it")
    one.add_argument("fit", type=Path, help="file to write; the nominal machine goes into a second one")
    one.set_defaults(run=plain)
    one = parts.add_parser("fitted", help="Write a fit of `exograv twin fit` in the form that `judge` reads.")
    one.add_argument("machine", type=Path, help="folder of the machine with twin.toml")
    one.add_argument("figures", type=Path, help="file of `exograv twin fit --json`")
    one.add_argument("fit", type=Path, help="file to write")
    one.set_defaults(run=lambda options: write_fitted(options.machine, options.figures, options.fit))
    one = parts.add_parser("judge", help=judged.__doc__)
    one.add_argument("truth", type=Path, help="file of --disclose")
    one.add_argument("fit", type=Path, help="fit in the form that `form` prints")
    one.add_argument("held_out", type=Path, help="held-out recording")
    one.set_defaults(run=judged)
    one = parts.add_parser("minutes", help="Print the errors of `exograv twin fit` by minutes of recording.")
    one.add_argument("folder", type=Path, help="folder of the recordings of `record`")
    one.add_argument("--names", nargs="+", default=["machine"])
    one.add_argument("--truth", type=Path, required=True, help="folder of --disclose")
    one.add_argument("--minutes", type=float, nargs="+", default=[1.0, 3.0, 10.0])
    one.set_defaults(run=minutes)
    one = parts.add_parser("further", help=further_motion.__doc__)
    one.add_argument("folder", type=Path, help="folder of the recordings of `record`")
    one.add_argument("--names", nargs="+", default=["machine"])
    one.add_argument("--truth", type=Path, required=True, help="folder of --disclose")
    one.add_argument("--minutes", type=float, default=1.0, help="part of the recording before the further motion")
    one.set_defaults(run=further_motion)
    one = parts.add_parser("pulled", help=pulled.__doc__)
    one.add_argument("folder", type=Path, help="folder of the recordings of `record --pulled`")
    one.add_argument("--names", nargs="+", default=["machine"])
    one.add_argument("--truth", type=Path, required=True, help="folder of --disclose")
    one.set_defaults(run=pulled)
    _add_flights(parts)
    one = parts.add_parser("form", help="Print the form of a fit.")
    one.set_defaults(run=lambda _options: print(FORM))
    options = parser.parse_args()
    options.run(options)


if __name__ == "__main__":
    main()
