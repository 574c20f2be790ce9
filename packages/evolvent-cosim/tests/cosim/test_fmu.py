"""Functional mock-up units: valid, equal to the stepper, and clean where workers, servers and hosts are killed."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import platform
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest

from evolvent import InputError, Stepper
from evolvent_cosim.fmu import contents, write
from evolvent_cosim.fmu.description import base_units

fmpy = pytest.importorskip("fmpy")
from fmpy import fmi3  # noqa: E402
from fmpy.fmi1 import FMICallException  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

pytestmark = pytest.mark.skipif(
    platform.system() != "Linux" or not shutil.which("cc"), reason="needs a C compiler, and /proc to look at processes"
)
ERROR, FATAL = 3, 4
#: A structure of a user's own.
CASE = """
parts:
  bus: {kind: rigid-body, mass: 30 kg, inertia: [2, 2, 3 kg m^2], points: {side: [0.3, 0, 0 m]}}
  mast: {kind: rigid-body, mass: 2 kg, inertia: [0.01, 0.2, 0.2 kg m^2], position: [1.3, 0, 0 m]}
  pivot: {kind: joint, a: bus.side, b: [mast, [-1, 0, 0 m]], type: revolute, axis: [0, 0, 1]}
  hinge:
    {kind: joint-spring, a: bus, b: mast, axis: [0, 0, 1], rest: 10 deg, stiffness: 5 N m/rad,
     damping: 0.1 N m s/rad}
simulate: {until: 4 s, every: 0.05 s, method: generalized-alpha, step: 10 ms}
"""
OUTPUTS = ["hinge.angle", "pivot.force", "hinge.torque"]
TORQUE, FORCE = "bus.applied_torque.z", "mast.applied_force.y"


class Unit:
    """A unit that is loaded into this process, and what its instances log."""

    def __init__(self, path: str, folder: str) -> None:
        self.path, self.folder, self.logged = path, folder, []
        self.about = fmpy.read_model_description(path)
        self.references = {v.name: v.valueReference for v in self.about.modelVariables}
        fmpy.extract(path, folder)
        self.library, self.instances = self.loaded(), []

    def loaded(self, **changes):
        given = {"guid": self.about.guid, "modelIdentifier": "unit", "instanceName": "one"} | changes
        return fmi3.FMU3Slave(unzipDirectory=self.folder, **given)

    def made(self, **changes):
        """An instance, as its own object with the library of this unit; freed at the end of the test."""
        found = self.loaded(**changes)
        assert found.dll._handle == self.library.dll._handle
        try:
            found.instantiate(loggingOn=True, logMessage=lambda _, status, kind, text: self.log(status, kind, text))
        except Exception:
            found.freeLibrary()
            raise
        self.instances.append(found)
        return found

    def free(self, instance):
        self.instances.remove(instance)
        instance.freeInstance()  # and its hold on the library

    def log(self, status, kind, text):
        self.logged.append((status, kind.decode(), text.decode()))

    def set(self, instance, **values):
        instance.setFloat64([self.references[name] for name in values], list(values.values()))

    def get(self, instance, *names):
        return instance.getFloat64([self.references[name] for name in names])

    def refused(self, status, call, *arguments, **keywords):
        """The message of a call that must fail with a status."""
        self.logged.clear()
        with pytest.raises(FMICallException) as error:
            call(*arguments, **keywords)
        assert error.value.status == status
        return " ".join(text for _, _, text in self.logged)


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmu")
    case = folder / "own.yaml"
    case.write_text(CASE)
    path = str(folder / "unit.fmu")
    write.write(contents.contents(str(case), {}, ["bus", "mast"], OUTPUTS), path)
    found = Unit(path, str(folder / "unit"))
    found.case = str(case)
    yield found
    found.library.freeLibrary()  # which ends the server, and waits for it
    assert not servers()


@pytest.fixture(autouse=True)
def _freed(request):
    yield
    if "unit" in request.fixturenames:
        unit = request.getfixturevalue("unit")
        for one in [*unit.instances]:
            unit.free(one)


@pytest.fixture
def instance(unit):
    """An instance in step mode."""
    return started(unit)


def started(unit, stop=4.0):
    found = unit.made()
    found.enterInitializationMode(startTime=0.0, stopTime=stop)
    found.exitInitializationMode()
    return found


def children(pid=None):
    pid = os.getpid() if pid is None else pid
    text = " ".join(path.read_text() for path in pathlib.Path(f"/proc/{pid}/task").glob("*/children"))
    return [int(word) for word in text.split()]


def is_running(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def servers():
    return [pid for pid in children() if b"evolvent_cosim.fmu" in pathlib.Path(f"/proc/{pid}/cmdline").read_bytes()]


def until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


# ------------------------------------------------------------------------------------------------ contents


@pytest.mark.slow
def test_the_unit_is_valid(unit):
    assert validate_fmu(unit.path) == []
    kinds = [v.causality for v in unit.about.modelVariables]
    assert kinds.count("input") == 12
    assert {"bus.attitude.w", "mast.rate.z", "hinge.angle", "pivot.force.x"} <= set(unit.references)
    assert {"parts.hinge.stiffness", "parts.bus.inertia.2", "gravity.2", "simulate.step"} <= set(unit.references)
    stiffness = next(v for v in unit.about.modelVariables if v.name == "parts.hinge.stiffness")
    assert (float(stiffness.start), stiffness.unit, stiffness.variability) == (5.0, "N m/rad", "fixed")
    assert unit.about.coSimulation.needsExecutionTool
    assert (unit.about.defaultExperiment.stopTime, unit.about.defaultExperiment.stepSize) == ("4.0", "0.05")


def test_the_token_follows_from_the_contents(unit):
    same, other = (
        contents.contents(unit.case, changes, ["bus", "mast"], OUTPUTS).data()["token"]
        for changes in ({}, {"parts.bus.mass": 31.0})
    )
    assert same == unit.about.guid != other


@pytest.mark.parametrize(
    ("unit_text", "exponents"),
    [
        ("N m", {"kg": 1, "m": 2, "s": -2}),
        ("kg m2 s-1", {"kg": 1, "m": 2, "s": -1}),
        ("N m s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("rad s-1", {"rad": 1, "s": -1}),
        ("N/m^n", None),
    ],
)
def test_units_in_base_units(unit_text, exponents):
    assert base_units(unit_text) == exponents


@pytest.mark.slow
def test_the_shim_declares_what_the_standard_does(tmp_path):
    """A compiler refuses a function that is declared in two ways."""
    headers = pathlib.Path(fmpy.__file__).with_name("c-code")
    own = re.sub(r"/\* -+ types of FMI 3.0 \*/.*?(?=/\* -+ instances \*/)", "", write.SHIM.read_text(), flags=re.DOTALL)
    own = own.replace("fmi3LockCallback", "fmi3LockPreemptionCallback")
    (tmp_path / "both.c").write_text('#include "fmi3Functions.h"\n' + own.replace("fmi3LockP", "fmi3LockP"))
    given = [
        *write.compiler(),
        "-std=gnu99",
        f"-I{headers}",
        "-D_GNU_SOURCE",
        "-fsyntax-only",
        str(tmp_path / "both.c"),
    ]
    found = subprocess.run(given, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr
    declared = set(re.findall(r"(fmi3\w+)TYPE", (headers / "fmi3Functions.h").read_text()))
    library = write.compiled()
    assert len(declared) > 70
    assert not [name for name in declared if f"\0{name}\0".encode() not in library]


def test_the_shim_compiles_without_a_warning(tmp_path):
    given = [*write.compiler(), "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", str(write.SHIM)]
    found = subprocess.run(given, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr


# ------------------------------------------------------------------------------------------------ equality


def test_a_simulation_is_that_of_the_stepper(unit):
    """By FMPy, with inputs over time: to the last bit."""
    t = np.linspace(0.0, 4.0, 81)
    inputs = np.zeros(t.size, dtype=[("time", float), (TORQUE, float), (FORCE, float)])
    inputs["time"], inputs[TORQUE], inputs[FORCE] = t, 0.3 * np.sin(2.0 * t), 0.1 * np.cos(t)
    names = [v.name for v in unit.about.modelVariables if v.causality == "output"]
    found = fmpy.simulate_fmu(
        unit.path, stop_time=4.0, output_interval=0.05, input=inputs, output=names,
        model_description=unit.about, fmu_instance=unit.made(),
    )  # fmt: skip
    stepper = Stepper.of_case(unit.case, inputs=["bus", "mast"], until=4.0)
    assert len(found) == t.size
    for k, row in enumerate(found):
        assert [row[name] for name in names] == [stepper.result(name) for name in names]
        if k + 1 < t.size:
            stepper.set_wrench("bus", torque=(0.0, 0.0, np.interp(row["time"], t, inputs[TORQUE])))
            stepper.set_wrench("mast", force=(0.0, np.interp(row["time"], t, inputs[FORCE]), 0.0))
            stepper.step(found[k + 1]["time"] - row["time"])
    assert np.ptp(found["hinge.angle"]) > 0.01


def test_parameters_are_keys_of_the_case(unit):
    changes = {"parts.hinge.stiffness": 8.0, "parts.mast.mass": 3.0, "parts.bus.inertia.2": 4.0}
    stepper = Stepper.of_case(unit.case, changes, inputs=["bus", "mast"], start=1.0, until=2.0)
    found = unit.made()
    unit.set(found, **changes)
    found.enterInitializationMode(startTime=1.0, stopTime=2.0)
    unit.set(found, **{TORQUE: 0.5})
    assert unit.get(found, "time", "parts.mast.mass", TORQUE) == [1.0, 3.0, 0.5]
    found.exitInitializationMode()
    stepper.set_wrench("bus", torque=(0.0, 0.0, 0.5))
    for k in range(4):
        assert found.doStep(1.0 + 0.25 * k, 0.25)[3] == 1.25 + 0.25 * k
        stepper.step(0.25)
        names = ["hinge.angle", "pivot.force.x", "bus.attitude.z", "time"]
        assert unit.get(found, *names) == [*(stepper.result(name) for name in names[:3]), stepper.time]
    found.terminate()
    angle = stepper.result("hinge.angle")
    assert unit.get(found, "hinge.angle") == [angle]
    found.reset()
    assert unit.get(found, "parts.mast.mass", TORQUE, "hinge.angle") == [2.0, 0.0, 0.0]
    unit.set(found, **changes, **{TORQUE: 0.5})
    found.enterInitializationMode(startTime=1.0, stopTime=2.0)
    found.exitInitializationMode()
    for k in range(4):
        found.doStep(1.0 + 0.25 * k, 0.25)
    assert unit.get(found, "hinge.angle") == [angle]


def test_the_last_step_may_end_late_by_rounding(unit):
    found = started(unit, 0.3)
    for k in range(3):
        found.doStep(0.1 * k, 0.1)
    assert unit.get(found, "time") == [pytest.approx(0.3, abs=1e-15)]


# ------------------------------------------------------------------------------------------------ errors


def test_what_cannot_be_done_is_an_error_with_a_sentence(unit, instance):
    set_one = instance.setFloat64
    mass = unit.references["parts.mast.mass"]
    for text, call in {
        "the step is to begin at 1.0 s, but the model is at 0.0 s": lambda: instance.doStep(1.0, 0.1),
        "beyond the stepper's end at 4 s": lambda: instance.doStep(0.0, 5.0),
        "dt is 0": lambda: instance.doStep(0.0, 0.0),
        "'bus.position.x' cannot be set": lambda: set_one([unit.references["bus.position.x"]], [1.0]),
        "'bus.applied_torque.z' is set to nan": lambda: set_one([unit.references[TORQUE]], [np.nan]),
        "'parts.mast.mass' is a parameter; it can be set before the first step only": lambda: set_one([mass], [1.0]),
        "no variable has the value reference 9999": lambda: instance.getFloat64([9999]),
        "fmi3GetInt32 is not supported": lambda: instance.getInt32([1]),
        "fmi3GetFMUState is not supported": instance.getFMUState,
        "the instance is in step mode; this function": lambda: instance.enterInitializationMode(startTime=0.0),
    }.items():
        assert text in unit.refused(ERROR, call)
    instance.doStep(0.0, 0.1)  # it goes on


def test_a_bad_parameter_is_an_error(unit):
    found = unit.made()
    unit.set(found, **{"parts.mast.mass": -1.0})
    found.enterInitializationMode(startTime=0.0, stopTime=1.0)
    assert "parts.mast.mass is -1.0; it must be a mass of 0 or above" in unit.refused(
        ERROR, found.exitInitializationMode
    )
    unit.set(found, **{"parts.mast.mass": 1.0})
    found.exitInitializationMode()


def test_what_cannot_be_instantiated_says_why(unit, tmp_path):
    def why(**changes):
        unit.logged.clear()
        with pytest.raises(Exception, match="Failed to instantiate"):
            unit.made(**changes)
        return " ".join(text for _, _, text in unit.logged)

    assert "the instantiation token is '{other}', but that of the resources is '{" in why(guid="{other}")
    path = pathlib.Path(unit.folder, "resources", "fmu.json")
    kept = path.read_text()
    try:
        path.write_text(json.dumps(json.loads(kept) | {"version": "0.0.1"}))
        folder = tmp_path / "moved"
        shutil.copytree(unit.folder, folder)
    finally:
        path.write_text(kept)
    moved = fmi3.FMU3Slave(guid=unit.about.guid, modelIdentifier="unit", instanceName="one", unzipDirectory=str(folder))
    unit.logged.clear()
    with pytest.raises(Exception, match="Failed to instantiate"):
        moved.instantiate(logMessage=lambda _, status, kind, text: unit.log(status, kind, text))
    moved.freeLibrary()
    assert "the FMU was made by evolvent 0.0.1, but" in unit.logged[-1][2]


@pytest.mark.parametrize(
    ("script", "text"),
    [
        (None, "cannot start the Python interpreter"),
        ("#!/bin/sh\necho 'No module named evolvent' >&2\nexit 1\n", "it has printed: No module named evolvent"),
    ],
)
def test_an_interpreter_that_does_not_serve_is_named(unit, tmp_path, monkeypatch, script, text):
    python = tmp_path / "python"
    if script is not None:
        python.write_text(script)
        python.chmod(0o755)
    monkeypatch.setenv("EVOLVENT_PYTHON", str(python))
    folder = tmp_path / "unit"  # its own library, which has no server yet
    shutil.copytree(unit.folder, folder)
    found = fmi3.FMU3Slave(guid=unit.about.guid, modelIdentifier="unit", instanceName="one", unzipDirectory=str(folder))
    logged = []
    before = os.listdir("/proc/self/fd")
    for _ in range(3):
        with pytest.raises(Exception, match="Failed to instantiate"):
            found.instantiate(logMessage=lambda _, status, kind, message: logged.append(message.decode()))
    assert text in logged[-1]
    found.freeLibrary()
    assert len(os.listdir("/proc/self/fd")) <= len(before)


# ------------------------------------------------------------------------------------------------ processes


@pytest.mark.slow
def test_a_killed_worker_is_fatal_for_its_instance_alone(unit, instance):
    other = unit.made()
    (server,) = servers()
    os.kill(children(server)[0], signal.SIGKILL)  # that of `instance`, the older one
    assert "the worker process of one has ended" in unit.refused(FATAL, instance.doStep, 0.0, 0.1)
    assert unit.refused(FATAL, instance.doStep, 0.0, 0.1) == ""
    assert unit.refused(FATAL, instance.getFloat64, [1]) == ""
    other.enterInitializationMode(startTime=0.0, stopTime=1.0)
    other.exitInitializationMode()
    os.kill(server, signal.SIGKILL)
    other.doStep(0.0, 0.1)
    third = unit.made()  # a new server
    assert servers() != [server]
    until(lambda: len(servers()) == 1)
    third.enterInitializationMode(startTime=0.0)


def test_workers_end_when_they_are_freed(unit, instance):
    (server,) = servers()
    assert len(children(server)) == 1
    other = unit.made()
    assert len(children(server)) == 2
    unit.free(other)
    until(lambda: len(children(server)) == 1)


HOST = """
import os, sys, time
from fmpy import fmi3, read_model_description
path, folder, cycles, what = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]
about = read_model_description(path)
unit = fmi3.FMU3Slave(guid=about.guid, unzipDirectory=folder, modelIdentifier="unit", instanceName="one")
outputs = [v.valueReference for v in about.modelVariables if v.causality == "output"]
seen = []
for k in range(cycles):
    unit.instantiate(loggingOn=True)
    unit.enterInitializationMode(startTime=0.0, stopTime=4.0)
    unit.exitInitializationMode()
    for n in range(3):
        unit.doStep(0.05 * n, 0.05)
    seen.append(tuple(unit.getFloat64(outputs)))
    unit.terminate()
    if what == "kill":
        print("ready", flush=True)
        sys.stdin.read()
    unit.fmi3FreeInstance(unit.component)
    if k == 1:
        files = len(os.listdir("/proc/self/fd"))
assert len(set(seen)) == 1
assert len(os.listdir("/proc/self/fd")) == files
(server,) = open(f"/proc/self/task/{os.getpid()}/children").read().split()
while open(f"/proc/{server}/task/{server}/children").read():
    time.sleep(0.01)
print("done")
"""


@pytest.mark.slow
def test_cycles_leave_nothing_behind(unit, tmp_path):
    """A host of its own, whose allocator fills what is freed, ends well; its worker has the allocator's defaults."""
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nunset MALLOC_PERTURB_ MALLOC_CHECK_\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    environment = os.environ | {"MALLOC_CHECK_": "3", "MALLOC_PERTURB_": "85", "EVOLVENT_PYTHON": str(python)}
    given = [sys.executable, "-c", HOST, unit.path, unit.folder, "6", "exit"]
    found = subprocess.run(given, capture_output=True, text=True, env=environment, timeout=300, check=False)
    assert (found.returncode, found.stdout) == (0, "done\n"), found.stderr
    assert not [pid for pid in everyone() if f"{unit.folder}/resources" in command(pid) and not of_this_process(pid)]


def test_a_killed_host_leaves_no_worker(unit):
    given = [sys.executable, "-c", HOST, unit.path, unit.folder, "1", "kill"]
    with subprocess.Popen(given, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as host:
        assert host.stdout.readline() == "ready\n"
        (server,) = children(host.pid)
        workers = children(server)
        assert len(workers) == 1
        host.kill()
    until(lambda: not any(map(is_running, [server, *workers])))


def of_this_process(pid):
    """Whether a process is a server of this one, or one of its workers."""
    return any(pid in (server, *children(server)) for server in servers())


def everyone():
    return [int(path.name) for path in pathlib.Path("/proc").iterdir() if path.name.isdigit()]


def command(pid):
    with contextlib.suppress(OSError):
        return pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace")
    return ""


# ------------------------------------------------------------------------------------------------ the command


@pytest.mark.slow
def test_the_command_writes_a_unit_that_can_be_compiled_elsewhere(call, tmp_path):
    code, out, err = call(
        "fmu", "boom-slew", "--inputs", "hub", "--outputs", "boom.tip.position, boom.tip_deflection.y"
    )
    assert (code, err) == (0, "")
    assert re.fullmatch(r"fmu: boom-slew.fmu, 6 inputs, 23 outputs, \d+ parameters\n", out)
    assert validate_fmu(str(tmp_path / "boom-slew.fmu")) == []
    with zipfile.ZipFile(tmp_path / "boom-slew.fmu") as archive:
        assert {"sources/shim.c", "sources/buildDescription.xml"} <= set(archive.namelist())
    assert [path.name for path in tmp_path.iterdir()] == ["boom-slew.fmu"]


BAD = {
    "unknown case": (["boom-slw"], "no case is called 'boom-slw'; did you mean 'boom-slew'?"),
    "unknown input": (["boom-slew", "--inputs", "hup"], "inputs name 'hup', which is no body; did you mean 'hub'?"),
    "unknown output": (
        ["boom-slew", "--outputs", "boom.tp"],
        "no variable is called 'boom.tp'; did you mean 'boom.slope'?",
    ),
    "too many values": (["boom-slew", "--outputs", "boom.position"], "name one entry, such as 'boom[0].position'"),
    "adds up": (["boom-slew", "--outputs", "slew.work"], "'slew.work' adds up over all samples of a run"),
    "not stepped": (["inertia-stand"], "system is 'inertia-stand', which is not stepped from outside"),
    "folder": (["boom-slew", "-o", "."], "cannot write '.'"),
}


@pytest.mark.parametrize("case", BAD)
def test_the_command_refuses(call, tmp_path, case):
    words, text = BAD[case]
    code, out, err = call("fmu", *words)
    assert (code, out) == (2, "")
    assert text in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_command_needs_a_compiler_and_a_known_system(call, monkeypatch):
    monkeypatch.setenv("CC", "no-such-cc")
    code, _, err = call("fmu", "boom-slew")
    assert (code, err) == (2, "evolvent: CC is 'no-such-cc', which is not found; name a C compiler, such as gcc\n")
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", "/nowhere")
    code, _, err = call("fmu", "boom-slew")
    assert code == 2
    assert "no C compiler is found, which an FMU needs; install gcc or clang" in err
    monkeypatch.setattr(platform, "system", lambda: "Windows")
    code, _, err = call("fmu", "boom-slew")
    assert (code, "an FMU cannot be made on Windows" in err) == (2, True)


def test_a_compiler_that_fails_says_why(monkeypatch, tmp_path):
    script = tmp_path / "cc"
    script.write_text("#!/bin/sh\necho 'broken headers' >&2\nexit 1\n")
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    with pytest.raises(Exception, match=r"does not compile shim\.c: broken headers"):
        write.compiled()


def test_names_of_libraries():
    found = [write.identifier_of(name) for name in ("a/boom-slew.fmu", "3 booms.fmu", "éa.fmu")]
    assert found == ["boom_slew", "fmu_3_booms", "fmu__a"]


@pytest.mark.slow
def test_no_results_no_unit(tmp_path):
    case = tmp_path / "case.yaml"
    case.write_text(
        "parts:\n  cord: {kind: beam, length: 1 m, section: {circle: 1 mm}, elements: 2,"
        " material: {young_modulus: 1 GPa, density: 1000 kg/m^3}}\nsimulate: {until: 1 s}\n"
    )
    with pytest.raises(InputError, match="the case has no bodies and no point masses; name results by --outputs"):
        contents.contents(str(case), {}, [], [])
