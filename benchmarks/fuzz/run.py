"""Coverage-guided fuzzing of everything that reads bytes which another program has written.

    python benchmarks/fuzz/run.py --seconds 60                    # every target, one after the other
    python benchmarks/fuzz/run.py --only recording --seconds 600
    python benchmarks/fuzz/run.py --repeat recording out/fuzz/recording/crash-0123

Atheris runs each target in a process of its own and keeps the inputs that reach new code in out/fuzz/TARGET/corpus; the
next run continues from there. An input is a crash if the reader raises an error that it does not document, asks for
more than `MEMORY_MB` more memory, or takes longer than `INPUT_S`. The crash is written to a file, with the command that
repeats it, and the exit code is 1. `--repeat` needs no Atheris.
"""

import argparse
import importlib
import importlib.util
import re
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

OUT = Path("out") / "fuzz"

TARGETS = {
    "shared_memory": ("exograv.runtime.processes.shared_memory",),
    "recording": ("exograv.recording",),
    "udp_packets": ("exograv.rig.drives.udp.packets", "exograv.rig.drives.udp.layout"),
    "console_messages": ("exograv.console.messages", "exograv.experiment.steered.requests"),
}
"""Modules whose branches guide the fuzzer, by target."""

MEMORY_MB = 1000
"""Address space that a target may take beyond that of its start [MB]. An unpacked chunk may have 64 MB."""

INPUT_S = 10
"""Time limit of one input [s]."""

LENGTH_MAX = 1 << 16
"""Largest input [byte]."""


def target(name: str) -> Any:
    """Import a target."""
    return importlib.import_module(f"fuzz.{name}")


def bound_memory() -> None:
    """Let a request for more than `MEMORY_MB` fail with a MemoryError."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = pages * resource.getpagesize() + MEMORY_MB * 1_000_000
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def run_target(name: str, seconds: int) -> None:
    """Fuzz one target in this process; Atheris ends the process."""
    atheris: Any = importlib.import_module("atheris")
    with atheris.instrument_imports(include=list(TARGETS[name])):
        one = target(name)
    corpus = OUT / name / "corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(one.seeds()):
        (corpus / f"seed-{number:03d}").write_bytes(seed)
    options = [
        f"-max_total_time={seconds}",
        f"-timeout={INPUT_S}",
        f"-max_len={LENGTH_MAX}",
        f"-artifact_prefix={OUT / name}/",
        "-print_final_stats=1",
    ]
    bound_memory()
    further: dict[str, Any] = {}
    if hasattr(one, "mutate"):
        further["custom_mutator"] = lambda data, size, seed: one.mutate(data, size, seed, atheris.Mutate)
    atheris.Setup([sys.argv[0], *options, str(corpus)], one.read, **further)
    atheris.Fuzz()


def fuzz(name: str, seconds: int) -> bool:
    """Fuzz one target in a process of its own and print its figures; return True if it found no crash."""
    folder = OUT / name
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, __file__, "--only", name, "--seconds", str(seconds), "--here"]
    log = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    text = log.stdout.decode(errors="replace")
    (folder / "log.txt").write_text(text, encoding="utf-8")
    print(f"{name}: {figures(text)}")
    if log.returncode == 0:
        return True
    crashes = re.findall(r"Test unit written to (\S+)", text)
    if not crashes:
        print(f"  The target ended with code {log.returncode} and no input; see {folder / 'log.txt'}.")
    for crash in crashes:
        repeat = f"python benchmarks/fuzz/run.py --repeat {name} {crash}"
        Path(f"{crash}.txt").write_text(f"{repeat}\n\n{text[-6000:]}", encoding="utf-8")
        print(f"  Crash: {crash}. To repeat it: {repeat}")
    return False


def figures(log: str) -> str:
    """Return executions, their rate and the reached branches, from the log of a target."""
    executions = re.findall(r"stat::number_of_executed_units:\s*(\d+)", log) or re.findall(r"^#(\d+)\s", log, re.M)
    rates = re.findall(r"stat::average_exec_per_sec:\s*(\d+)", log) or re.findall(r"exec/s: (\d+)", log) or ["0"]
    reached = re.findall(r"cov: (\d+)", log) or ["0"]
    count = executions[-1] if executions else "0"
    return f"{count} inputs, {rates[-1]} per second, {reached[-1]} branches reached"


def repeat(name: str, file: Path) -> None:
    """Read one input again. A crash shows as its traceback."""
    one = target(name)
    bound_memory()
    one.read(file.read_bytes())
    print(f"{file} is no crash of {name} any more.")


def main() -> None:
    """Fuzz the targets, or repeat an input; exit with 1 on a crash."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=60, help="time per target [s]")
    parser.add_argument("--only", nargs="+", choices=tuple(TARGETS), default=list(TARGETS))
    parser.add_argument("--repeat", nargs=2, metavar=("TARGET", "FILE"), help="read one input again")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.repeat:
        name, file = options.repeat
        repeat(name, Path(file))
        return
    if importlib.util.find_spec("atheris") is None:
        raise SystemExit("Atheris is missing: it exists for Linux on x86-64 only, and `make fuzz` installs it there.")
    if options.here:
        run_target(options.only[0], options.seconds)
    # A list: every target runs, also after a crash of another.
    found = [name for name in options.only if not fuzz(name, options.seconds)]
    if found:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
