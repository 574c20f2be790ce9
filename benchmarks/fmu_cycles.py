"""Create, step and free an instance of a unit, again and again, in one host: times, memory, descriptors, processes.

    python benchmarks/fmu_cycles.py [cycles]

It needs FMPy, a C compiler and /proc.
"""

import os
import pathlib
import sys
import tempfile
import time

import fmpy
from fmpy.fmi3 import FMU3Slave

from evolvent_cosim.fmu import contents, write


def memory() -> float:
    """Memory of this process, MiB."""
    pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def children(pid: int) -> list[int]:
    """Processes that a process has started, zombies included."""
    return [int(word) for word in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def main(cycles: int) -> None:
    """Run the cycles and print what they took and left."""
    folder = tempfile.mkdtemp(prefix="evolvent-fmu-")
    path = os.path.join(folder, "unit.fmu")
    write.write(contents.contents("boom-slew", {}, ["hub"], ["boom.tip_deflection.y"]), path)
    about = fmpy.read_model_description(path)
    unit = FMU3Slave(
        guid=about.guid, modelIdentifier="unit", instanceName="one", unzipDirectory=fmpy.extract(path, folder)
    )
    outputs = [v.valueReference for v in about.modelVariables if v.causality == "output"]
    found, times, marks = set(), [], {}
    for cycle in range(cycles):
        began = time.perf_counter()
        unit.instantiate()
        unit.enterInitializationMode(startTime=0.0, stopTime=20.0)
        unit.exitInitializationMode()
        for n in range(5):
            unit.doStep(0.02 * n, 0.02)
        found.add(tuple(unit.getFloat64(outputs)))
        unit.terminate()
        unit.fmi3FreeInstance(unit.component)
        times.append(time.perf_counter() - began)
        if cycle in (min(9, cycles - 1), cycles - 1):
            marks[cycle + 1] = (memory(), len(os.listdir("/proc/self/fd")), len(children(os.getpid())))
    time.sleep(1.0)
    (server,) = children(os.getpid())
    left = children(server)
    unit.freeLibrary()
    print(
        f"{cycles} cycles in {sum(times):.1f} s: the first {times[0]:.2f} s, "
        f"the median {sorted(times)[cycles // 2]:.3f} s"
    )
    for cycle, (size, files, processes) in marks.items():
        print(f"after {cycle}: {size:.1f} MiB, {files} descriptors, {processes} child process")
    print(f"different results: {len(found)}; workers left: {len(left)}; after unloading: {len(children(os.getpid()))}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
