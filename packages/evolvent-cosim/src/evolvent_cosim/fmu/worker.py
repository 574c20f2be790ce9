"""The server and the workers behind the functions of FMI: ``python -P -m evolvent_cosim.fmu.worker RESOURCES``.

`shim.c` starts one server per loaded library. For every instance it sends the server two descriptors, and the server
forks a worker, so that Python and the compiled functions are loaded once. `shim.c` describes the messages too.
"""

from __future__ import annotations

import contextlib
import enum
import gc
import json
import math
import os
import pathlib
import signal
import socket
import struct
import sys
import traceback
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from evolvent import cases
from evolvent_base import __version__, startup
from evolvent_base.errors import EvolventError, InputError

OK, ERROR = 0, 3
#: Difference between the importer's time and the model's that is rounding: of the step, and of the time.
_ROUNDING, _ROUNDING_OF_TIME = 1e-6, 1e-9


class Operation(enum.IntEnum):
    """What the shim asks for."""

    START, INITIALIZE, BEGIN, STEP, GET, SET, RESET, TERMINATE = range(1, 9)


class Mode(enum.Enum):
    """State of an instance; the value is what messages call it."""

    INSTANTIATED = "not initialized"
    INITIALIZATION = "in initialization mode"
    STEP = "in step mode"
    TERMINATED = "terminated"


class Instance:
    """An instance of a unit.

    Parameters
    ----------
    folder : str, the resources of the unit

    Raises
    ------
    InputError
        If the unit was made by another version of the package.
    """

    def __init__(self, folder: str) -> None:
        data = json.loads(pathlib.Path(folder, "fmu.json").read_text(encoding="utf-8"))
        if data["version"] != __version__:
            raise InputError(
                f"the FMU was made by evolvent {data['version']}, but {sys.executable} has evolvent {__version__}; "
                f"make the FMU again, or name another interpreter by EVOLVENT_PYTHON"
            )
        self.folder = folder
        self.token: str = data["token"]
        self._case = cases.parse_yaml(pathlib.Path(folder, "case.yaml").read_text(encoding="utf-8"), "case.yaml")
        self._inputs: list[str] = data["inputs"]
        self._variables: list[dict[str, Any]] = data["variables"]
        self.reset()

    def __len__(self) -> int:
        return len(self._variables)

    def reset(self) -> None:
        """Return to the state after instantiation."""
        self.mode = Mode.INSTANTIATED
        self._start, self._stop = 0.0, math.nan
        self._values: dict[int, float] = {
            k: v["start"] for k, v in enumerate(self._variables) if v["start"] is not None
        }
        self._stepper: Any = None

    def initialize(self, tolerance: float, start: float, stop: float) -> None:
        """Enter the initialization mode; the tolerance is that of the case."""
        self._require(Mode.INSTANTIATED)
        self._start, self._stop = start, stop
        self._stepper, self.mode = None, Mode.INITIALIZATION

    def begin(self) -> None:
        """Leave the initialization mode."""
        self._require(Mode.INITIALIZATION)
        self.stepper()
        self.mode = Mode.STEP

    def terminate(self) -> None:
        """End the simulation; results can still be read."""
        self._require(Mode.STEP)
        self.mode = Mode.TERMINATED

    def step(self, time: float, size: float) -> float:
        """Step on; returns the time reached, s."""
        self._require(Mode.STEP)
        stepper = self.stepper()
        if not abs(time - stepper.time) <= _ROUNDING * abs(size) + _ROUNDING_OF_TIME * max(1.0, abs(time)):
            raise InputError(f"the step is to begin at {time!r} s, but the model is at {stepper.time!r} s")
        over = stepper.time + size - stepper.until
        if 0.0 < over <= _ROUNDING * size:
            size = stepper.until - stepper.time
        for k, body in enumerate(self._inputs):
            values = [self._values[1 + 6 * k + i] for i in range(6)]
            stepper.set_wrench(body, values[:3], values[3:])
        stepper.step(size)
        return float(stepper.time)

    def get(self, references: tuple[int, ...]) -> list[float]:
        """Values of variables."""
        return [self._value(reference) for reference in references]

    def set(self, values: Mapping[int, float]) -> None:
        """Set inputs and parameters."""
        for reference, value in values.items():
            variable = self._variable(reference)
            if variable["causality"] not in ("input", "parameter"):
                raise InputError(f"{variable['name']!r} cannot be set; inputs and parameters can")
            if not math.isfinite(value):
                raise InputError(f"{variable['name']!r} is set to {value}; it must be finite")
            if variable["causality"] == "parameter":
                if self.mode not in (Mode.INSTANTIATED, Mode.INITIALIZATION):
                    raise InputError(f"{variable['name']!r} is a parameter; it can be set before the first step only")
                if value != self._values[reference]:
                    self._stepper = None
            self._values[reference] = value

    def stepper(self) -> Any:
        """The model, made when it is first needed."""
        if self._stepper is None:
            from evolvent.analysis.stepper import Stepper  # loads the engine, after the process has answered

            changed = {
                v["name"]: self._values[k]
                for k, v in enumerate(self._variables)
                if v["causality"] == "parameter" and self._values[k] != v["start"]
            }
            until = None if math.isnan(self._stop) else self._stop
            self._stepper = Stepper.of_case(self._case, changed, inputs=self._inputs, start=self._start, until=until)
        return self._stepper

    def _value(self, reference: int) -> float:
        variable = self._variable(reference)
        if reference in self._values:
            return self._values[reference]
        if variable["causality"] == "independent":
            return self._start if self._stepper is None else float(self._stepper.time)
        from evolvent.analysis.stepping import ResultAddress  # loads the engine, after the process has answered

        return float(self.stepper().value(ResultAddress(*variable["address"])))

    def _variable(self, reference: int) -> dict[str, Any]:
        if reference >= len(self._variables):
            raise InputError(
                f"no variable has the value reference {reference}; there are 0 to {len(self._variables) - 1}"
            )
        return self._variables[reference]

    def _require(self, mode: Mode) -> None:
        if self.mode is not mode:
            raise InputError(f"the instance is {self.mode.value}; this function is for one that is {mode.value}")


# ------------------------------------------------------------------------------------------------ messages


def answer_requests(connection: socket.socket, prepared: Instance | None) -> None:
    """Answer the requests of an instance until its socket closes.

    Parameters
    ----------
    connection : socket
    prepared : Instance, which is taken where it is of the same folder
    """
    instance: Instance | None = None
    while True:
        head = _received(connection, 8)
        if head is None:
            return
        operation, size = struct.unpack("=II", head)
        payload = _received(connection, size)
        if payload is None:
            return
        status, answer = OK, b""
        try:
            if operation == Operation.START:
                instance = _started(payload, prepared)
            else:
                assert instance is not None
                answer = _ANSWERS[Operation(operation)](instance, payload)
        except EvolventError as error:
            status, answer = ERROR, str(error).encode()
        except Exception as error:  # noqa: BLE001  (the importer gets every failure as a status)
            traceback.print_exc()
            status, answer = ERROR, f"{type(error).__name__}: {error}".encode()
        sys.stdout.flush()
        sys.stderr.flush()
        connection.sendall(struct.pack("=II", status, len(answer)) + answer)


def _received(connection: socket.socket, size: int) -> bytes | None:
    """Exactly `size` bytes; None where the other end has closed."""
    parts: list[bytes] = []
    while size > 0:
        part = connection.recv(size)
        if not part:
            return None
        parts.append(part)
        size -= len(part)
    return b"".join(parts)


def _started(payload: bytes, prepared: Instance | None) -> Instance:
    token, folder, _ = payload.decode().split("\0")
    instance = prepared if prepared is not None and prepared.folder == folder else Instance(folder)
    if token != instance.token:
        raise InputError(f"the instantiation token is {token!r}, but that of the resources is {instance.token!r}")
    return instance


def _get(instance: Instance, payload: bytes) -> bytes:
    count = len(payload) // 4
    return struct.pack(f"={count}d", *instance.get(struct.unpack(f"={count}I", payload)))


def _set(instance: Instance, payload: bytes) -> bytes:
    count = struct.unpack_from("=I", payload)[0]
    found = struct.unpack_from(f"={count}I{count}d", payload, 4)
    instance.set(dict(zip(found[:count], found[count:], strict=True)))
    return b""


def _without_answer(call: Callable[..., None]) -> Callable[[Instance, bytes], bytes]:
    """An operation on doubles that returns nothing."""

    def answer(instance: Instance, payload: bytes) -> bytes:
        call(instance, *struct.unpack(f"={len(payload) // 8}d", payload))
        return b""

    return answer


_ANSWERS: Mapping[Operation, Callable[[Instance, bytes], bytes]] = {
    Operation.INITIALIZE: _without_answer(Instance.initialize),
    Operation.BEGIN: _without_answer(Instance.begin),
    Operation.STEP: lambda instance, payload: struct.pack("=d", instance.step(*struct.unpack("=2d", payload))),
    Operation.GET: _get,
    Operation.SET: _set,
    Operation.RESET: _without_answer(Instance.reset),
    Operation.TERMINATE: _without_answer(Instance.terminate),
}


# ------------------------------------------------------------------------------------------------ the server


def serve(folder: str) -> NoReturn:
    """Fork a worker for every pair of descriptors that comes in, until the socket on standard input closes."""
    for descriptor in map(int, os.listdir("/dev/fd")):  # what the host has left open
        if descriptor > 2:
            with contextlib.suppress(OSError):
                os.close(descriptor)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # which is for the host
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # workers leave no zombies
    startup.prepare_process()
    control = socket.socket(fileno=os.dup(0))
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    prepared = None
    with contextlib.suppress(Exception):  # the worker reports it
        prepared = Instance(folder)
        prepared.get(tuple(range(len(prepared))))  # loads what every worker needs, which its fork shares
        prepared.reset()
    gc.collect()
    gc.freeze()
    while True:
        try:
            message, descriptors, _, _ = socket.recv_fds(control, 1, 2)
        except OSError:
            message, descriptors = b"", []
        if not message:
            _end()
        if os.fork() == 0:
            control.close()
            _be_worker(prepared, *descriptors)
        for descriptor in descriptors:
            os.close(descriptor)


def _be_worker(prepared: Instance | None, connection: int, output: int) -> NoReturn:
    """Serve an instance, in its own process."""
    code = 1
    try:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        os.dup2(output, 1)
        os.dup2(output, 2)
        os.close(output)
        answer_requests(socket.socket(fileno=connection), prepared)
        code = 0
    except OSError:  # the importer has gone
        code = 0
    finally:
        os._exit(code)


def _end() -> NoReturn:
    """End with all workers of this server: the host has gone, or has unloaded the library."""
    if os.getpgrp() == os.getpid():
        os.killpg(os.getpgrp(), signal.SIGKILL)
    os._exit(0)


if __name__ == "__main__":
    serve(sys.argv[1])
