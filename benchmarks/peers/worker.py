"""A process that does one program's work: a request as a line of JSON on stdin, an answer as one on stdout.

    python worker.py with_mujoco

What the program prints meanwhile, from C as well, is caught and sent along.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import tempfile
import time
from typing import Any

#: Runs are repeated until so much time has gone, s.
LONG_ENOUGH = 0.1


def once(module: Any, request: dict[str, Any]) -> dict[str, Any]:
    """One run: its answer with the seconds of stepping alone and of all, from plain numbers to the last place."""
    began = time.perf_counter()
    given = [request[key] for key in ("work", "spec", "options", "step")]
    try:
        run = module.prepare(*given)
        middle = time.perf_counter()
        answer = run()
    except Exception as error:  # noqa: BLE001  (whatever a program raises is what it did)
        return {"raised": f"{type(error).__name__}: {error}".strip()}
    end = time.perf_counter()
    answer.setdefault("stepping", end - middle)
    return {"all": end - began, **answer}


def answer(module: Any, request: dict[str, Any]) -> dict[str, Any]:
    """The last of the runs, with the seconds of each."""
    began, stepping, total = time.perf_counter(), [], []
    while True:
        found = once(module, request)
        if "raised" in found or not request["timed"]:
            break
        stepping.append(found["stepping"])
        total.append(found["all"])
        if time.perf_counter() - began > LONG_ENOUGH:
            break
    return {**found, "stepping": stepping, "all": total}


def main() -> None:
    """Answer until stdin ends."""
    wire = os.fdopen(os.dup(1), "w", encoding="utf-8")
    with tempfile.TemporaryFile() as said:
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
        try:
            module = importlib.import_module(sys.argv[1])
            ready: dict[str, Any] = {"version": module.version()}
        except Exception as error:  # noqa: BLE001  (a program that cannot be loaded does not take part)
            module, ready = None, {"missing": f"{type(error).__name__}: {error}"}
        print(json.dumps(ready), file=wire, flush=True)
        for line in sys.stdin:
            said.truncate(0)
            said.seek(0)
            found = answer(module, json.loads(line))
            sys.stdout.flush()
            sys.stderr.flush()
            said.seek(0)
            found["said"] = said.read().decode(errors="replace").replace("\0", "")[-4000:]
            print(json.dumps(found), file=wire, flush=True)


if __name__ == "__main__":
    main()
