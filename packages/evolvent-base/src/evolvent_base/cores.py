"""What this machine has for the process: cores and free memory."""

from __future__ import annotations

import math
import os
import sys


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def free_memory() -> float:
    """Memory that is free, bytes; infinite where the system does not say."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            rows = dict(line.split(":", 1) for line in file)
        return 1024.0 * float(rows["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return math.inf
