"""Bill of materials of the lock files, and the known advisories about their packages.

    python benchmarks/audit.py

For each lock file, cyclonedx-py writes a bill of materials (CycloneDX, JSON) to out/audit. pip-audit asks one advisory
service, and for packages without an answer the next one. The audit publishes and judges nothing: an advisory, or a
service that cannot be reached, ends with a sentence and exit code 0. A package without an answer is never counted as
free of advisories.
"""

import json
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
OUT = Path("out") / "audit"

SERVICES = ("pypi", "osv")
"""Advisory services by their names in pip-audit, in the order of asking."""

ANSWER_S = 15
"""Time limit of one request to a service [s]."""

SERVICE_S = 300
"""Time limit for all requests to a service [s]."""


Package = tuple[str, str]
"""Name and version."""

Advisories = dict[Package, list[dict[str, Any]]]
"""Advisories of each package for which a service has answered; an empty list is a good answer."""


def bill(lock: Path) -> list[dict[str, Any]] | None:
    """Write the bill of materials of a lock file; return its packages, or None if the tool failed."""
    file = OUT / f"{lock.stem}.cdx.json"
    file.unlink(missing_ok=True)
    command = [sys.executable, "-m", "cyclonedx_py", "requirements", str(lock), "--output-reproducible"]
    project = ["--pyproject", str(ROOT / "pyproject.toml")]
    done = _run([*command, *project, "--of", "JSON", "-o", str(file)], SERVICE_S)
    return json.loads(file.read_text(encoding="utf-8"))["components"] if done and file.exists() else None


def ask(service: str, packages: Collection[Package]) -> Advisories:
    """Return the answers of one service; packages without an answer are left out."""
    found: Advisories = {}
    for number, part in enumerate(parts(packages)):
        asked, answer = OUT / f"packages-{service}-{number}.txt", OUT / f"advisories-{service}-{number}.json"
        answer.unlink(missing_ok=True)
        asked.write_text("".join(f"{name}=={version}\n" for name, version in part), encoding="utf-8")
        command = [sys.executable, "-m", "pip_audit", "--vulnerability-service", service, "--timeout", str(ANSWER_S)]
        # All versions are known: pip must resolve and install nothing.
        options = ["--disable-pip", "--no-deps", "--progress-spinner", "off", "--format", "json", "--desc", "on"]
        _run([*command, *options, "--output", str(answer), "--requirement", str(asked)], SERVICE_S)
        # The exit code is 1 for an advisory, and also for a service that cannot be reached: the file tells them apart.
        if answer.exists():
            found |= answers(json.loads(answer.read_text(encoding="utf-8")))
    return found


def parts(packages: Collection[Package]) -> list[list[Package]]:
    """Divide packages into lists that hold each name once: lock files may pin different versions of a package."""
    divided: list[dict[str, str]] = []
    for name, version in sorted(packages):
        free = next((part for part in divided if name not in part), None)
        if free is None:
            divided.append(free := {})
        free[name] = version
    return [list(part.items()) for part in divided]


def answers(report: dict[str, Any]) -> Advisories:
    """Return the answers in a report of pip-audit; it lists packages that the service does not know as skipped."""
    return {
        (package["name"], package["version"]): package["vulns"]
        for package in report["dependencies"]
        if "skip_reason" not in package
    }


def _run(command: list[str], limit_s: float) -> bool:
    """Run a tool and keep its messages in out/audit/log.txt; return True if it ended well and in time."""
    with (OUT / "log.txt").open("a", encoding="utf-8") as log:
        log.write(" ".join(command[1:]) + "\n")
        log.flush()
        try:
            return subprocess.run(command, stdout=log, stderr=log, timeout=limit_s, check=False).returncode == 0
        except subprocess.TimeoutExpired:
            return False


def summary(packages: Collection[Package], advisories: Advisories) -> list[str]:
    """Return the lines that report the advisories."""
    if not advisories:
        return ["Advisories: unknown. No service has answered for any package, so nothing was audited."]
    count = sum(map(len, advisories.values()))
    lines = [f"Advisories: {count} for {len(advisories)} audited packages."]
    for (name, version), rows in sorted(advisories.items()):
        for row in rows:
            mended = ", ".join(row.get("fix_versions", ())) or "no version yet"
            about = (row.get("description") or "no description").strip().splitlines()[0][:100]
            lines.append(f"  {name} {version}: {row['id']}, mended in {mended}: {about}")
    if missing := sorted(name for name, version in set(packages) - advisories.keys()):
        lines.append(
            f"  No service has answered for {len(missing)} packages; these are not audited: {', '.join(missing)}."
        )
    return lines


def main() -> None:
    """Write bills and advisories, and print a summary."""
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "log.txt").unlink(missing_ok=True)
    packages, advisories = set[Package](), Advisories()
    for lock in sorted(ROOT.glob("requirements*.lock")):
        components = bill(lock)
        if components is None:
            print(f"{lock.name}: no bill of materials, because the tool failed; see {OUT / 'log.txt'}.")
            continue
        print(f"{lock.name}: {len(components)} packages, in {OUT / lock.stem}.cdx.json")
        packages |= {(one["name"], one["version"]) for one in components}
    print(f"Bill of materials: {len(packages)} packages in all lock files together.")
    for service in SERVICES:
        if rest := packages - advisories.keys():
            found = ask(service, rest)
            advisories |= found
            print(f"Advisory service {service}: answers for {len(found)} of {len(rest)} packages.")
    print("\n".join(summary(packages, advisories)))


if __name__ == "__main__":
    main()
