"""Test the lower bounds of the dependencies: `python3 start.py lowest [EXTRA ...] [-- options of pytest]`.

A virtual environment in build/lowest/ gets each dependency at the lower bound that packages/*/pyproject.toml state,
also those of the extras that are named (`sweep`, `studio`, ...), and a fast part of the tests runs in it.

Usage: python3 tools/lowest.py [EXTRA ...] [-- options of pytest]
"""

from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import workspace

ROOT = workspace.ROOT
FOLDER = ROOT / "build" / "lowest"
#: What the tests themselves need, in any version.
TOOLS = ("hypothesis", "imageio", "npTDMS", "psutil", "pytest", "pyuff")
#: What runs unless pytest's options name something: input, units, kernels, solvers, files, command.
TESTS = (
    "tests/analytic/test_reel_closed_forms.py",
    "tests/cli/test_cli.py",
    "tests/elements/test_sections.py",
    "tests/exports/test_report.py",
    "packages/evolvent-massprops/tests/massprops/signals/test_formats.py",
    "tests/unit/test_cases.py",
    "tests/unit/test_expressions.py",
    "tests/unit/test_netcdf.py",
    "tests/unit/test_run.py",
    "tests/unit/test_units.py",
    "packages/evolvent-massprops/tests/massprops/test_pendulums.py",
)


def name_and_bound(requirement: str) -> tuple[str, str] | None:
    """Name and lower bound of a requirement such as 'numpy>=2.2'; None if it has no lower bound."""
    found = re.fullmatch(r"([A-Za-z0-9._-]+)(?:\[[^\]]*\])?>=([0-9][0-9A-Za-z.]*)(?:,<[0-9.]+)?", requirement)
    return (found[1].lower(), found[2]) if found else None


def bounds(project: dict, extras: list[str]) -> dict[str, str]:
    """Lower bounds by name of the dependencies and of the extras, those that the extras include among them.

    Raises
    ------
    SystemExit
        If an extra is unknown, or a dependency has no lower bound.
    """
    optional = project["optional-dependencies"]
    found: dict[str, str] = {}
    for key in ["", *extras]:
        if key and key not in optional:
            sys.exit(f"no extra {key!r}; there are {', '.join(sorted(optional))}")
        for requirement in optional[key] if key else project["dependencies"]:
            if inner := re.fullmatch(r"evolvent\[(.*)\]", requirement):
                found |= bounds(project, [name.strip() for name in inner[1].split(",")])
            elif pair := name_and_bound(requirement):
                found[pair[0]] = pair[1]
            elif "==" not in requirement:
                sys.exit(f"{requirement!r} has no lower bound in pyproject.toml")
    return found


def main(words: list[str]) -> int:
    """Install and test; returns the exit code."""
    cut = words.index("--") if "--" in words else len(words)
    extras, options = words[:cut], words[cut + 1 :]
    project = workspace.root()
    lines = [f"{name}=={version}" for name, version in sorted(bounds(project, extras).items())]
    FOLDER.mkdir(parents=True, exist_ok=True)
    constraints = FOLDER / "constraints.txt"
    constraints.write_text("\n".join([*lines, ""]), encoding="utf-8")
    print("\n".join(lines), flush=True)
    place = FOLDER / "venv" / ("Scripts" if os.name == "nt" else "bin")
    python = str(place / "python")
    target = f"{ROOT}[{','.join(extras)}]" if extras else str(ROOT)
    pip = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    steps = [
        [sys.executable, "-m", "venv", "--clear", str(FOLDER / "venv")],
        [*pip, "-c", str(constraints), "-e", target, *TOOLS],
        # an old release may warn of what a newer library below it deprecates
        [
            python,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "-W",
            "ignore::DeprecationWarning",
            *(options or TESTS),
        ],
    ]
    for step in steps:
        if code := subprocess.run(step, cwd=ROOT, check=False).returncode:
            return code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
