"""Write a unit: compile the shim, and pack all files."""

from __future__ import annotations

import json
import os
import pathlib
import platform
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

from evolvent_base.errors import EvolventError, InputError
from evolvent_cosim.fmu.contents import Contents
from evolvent_cosim.fmu.description import build_description, model_description

SHIM = pathlib.Path(__file__).with_name("shim.c")
_MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
_SYSTEMS = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib")}


def write(contents: Contents, path: str) -> None:
    """Write a unit.

    Raises
    ------
    InputError
        On a system for which there is no shim, or without a C compiler.
    """
    folder, ending = platform_of()
    identifier = identifier_of(path)
    files = {
        "modelDescription.xml": model_description(contents, identifier),
        f"binaries/{folder}/{identifier}{ending}": compiled(),
        "sources/buildDescription.xml": build_description(identifier, SHIM.name),
        f"sources/{SHIM.name}": SHIM.read_bytes(),
        "resources/case.yaml": contents.case.encode(),
        "resources/fmu.json": (json.dumps(contents.data(), indent=1) + "\n").encode(),
        "resources/python.txt": f"{sys.executable}\n".encode(),
    }
    part = f"{path}.part"
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
        os.replace(part, path)
    finally:
        pathlib.Path(part).unlink(missing_ok=True)


def identifier_of(path: str) -> str:
    """Name of a unit's library: that of its file, in letters, digits and underscores."""
    stem = re.sub(r"\W", "_", os.path.splitext(os.path.basename(path))[0], flags=re.ASCII)
    return stem if re.match(r"[A-Za-z]", stem) else f"fmu_{stem}"


def platform_of() -> tuple[str, str]:
    """Name of this machine's platform in FMI 3.0, and the ending of its libraries.

    Raises
    ------
    InputError
        For a system that the shim is not written for.
    """
    system, machine = platform.system(), platform.machine().lower()
    if system not in _SYSTEMS or machine not in _MACHINES:
        raise InputError(f"an FMU cannot be made on {system} {machine}; it needs Linux or macOS, on x86_64 or aarch64")
    name, ending = _SYSTEMS[system]
    return f"{_MACHINES[machine]}-{name}", ending


def compiler() -> list[str]:
    """The C compiler: that of the environment variable CC, else one of this machine.

    Raises
    ------
    InputError
        If there is none.
    """
    given = shlex.split(os.environ.get("CC", ""))
    if given and shutil.which(given[0]) is None:
        raise InputError(f"CC is {os.environ['CC']!r}, which is not found; name a C compiler, such as gcc")
    others = ["cc", "gcc", "clang", *shlex.split(sysconfig.get_config_var("CC") or "")[:1]]
    found = next((name for name in others if shutil.which(name)), None)
    if not given and found is None:
        raise InputError("no C compiler is found, which an FMU needs; install gcc or clang, or name one by CC")
    return given or [str(found)]


def compiled() -> bytes:
    """The shim as a shared library of this machine.

    Raises
    ------
    EvolventError
        If the compiler fails.
    """
    with tempfile.TemporaryDirectory(prefix="evolvent-fmu-") as folder:
        target = os.path.join(folder, "shim.so")
        options = ["-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-pthread"]
        command = [*compiler(), *options, "-o", target, str(SHIM)]
        found = subprocess.run(command, capture_output=True, text=True, check=False)
        if found.returncode != 0:
            reason = next(iter(found.stderr.strip().splitlines()), f"exit code {found.returncode}")
            raise EvolventError(f"{command[0]} does not compile {SHIM.name}: {reason}")
        return pathlib.Path(target).read_bytes()
