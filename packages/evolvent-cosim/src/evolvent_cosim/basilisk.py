"""A module of Basilisk, the simulator of spacecraft dynamics and flight software, in which a stepper is the spacecraft.

Its messages have the names and contents of those of Basilisk's `Spacecraft` and `ExtForceTorque`, so that navigation,
control and actuators of Basilisk connect to it as to these. Basilisk is the package `bsk`; it is imported with this
module alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.analysis.stepper import Stepper
from evolvent.analysis.stepping import ResultAddress
from evolvent.results.rotations import turned
from evolvent_base.errors import InputError, nearest

try:
    from Basilisk.architecture import messaging, sysModel
except ImportError as error:
    raise InputError(
        "the module of Basilisk needs the package `bsk`: pip install 'evolvent-cosim[basilisk]'"
    ) from error

#: Nanoseconds, the unit of Basilisk's clock.
NANO = 1e-9
#: Fewest nanoseconds of a step; Basilisk calls a module at its start and where tasks meet.
LEAST = 1


class SpacecraftModule(sysModel.SysModel):  # type: ignore[misc, unused-ignore]
    """A stepper in the place of Basilisk's spacecraft.

    Attributes
    ----------
    scStateOutMsg : SCStatesMsg
        Of `hub`: ``r_BN_N``, ``v_BN_N`` of its origin, ``sigma_BN``, ``omega_BN_B``. The common centre of mass
        (``r_CN_N``, ``v_CN_N``) and what is accumulated are NaN: a stepper does not give them.
    cmdTorqueInMsg, cmdForceBodyInMsg, cmdForceInertialInMsg
        Readers of torque and force (N m, N) at the hub's origin, body or inertial axes; those that are linked add up.
    times : list of float, s, at which the module was called
    results : dict of list, name of a result -> its values at these times

    Parameters
    ----------
    stepper : Stepper
    hub : str, body whose motion the messages carry; without one the only one of the stepper's inputs
    results : names of results that are kept at every call, as of `Stepper.result`

    Raises
    ------
    InputError
        For a body that is not among the inputs, or a result that the system does not have.

    Notes
    -----
    At a call at the time t the stepper goes on from the call before to t under what its readers hold at t, which is
    what other modules have written until then: commands are held over a step of the module's task. With the process's
    tasks in the usual order these are commands from the state at the step's start.

    Examples
    --------
    >>> module = SpacecraftModule(stepper, "hub")  # doctest: +SKIP
    >>> scenario.AddModelToTask("dynamics", module)  # doctest: +SKIP
    >>> navigation.scStateInMsg.subscribeTo(module.scStateOutMsg)  # doctest: +SKIP
    >>> module.cmdTorqueInMsg.subscribeTo(control.cmdTorqueOutMsg)  # doctest: +SKIP
    """

    def __init__(self, stepper: Stepper, hub: str | None = None, *, results: Sequence[str] = ()) -> None:
        super().__init__()
        inputs = stepper.inputs
        if hub is None and len(inputs) == 1:
            hub = inputs[0]
        if hub not in inputs:
            raise InputError(f"hub is {hub!r}, which is not among the stepper's inputs; {nearest(str(hub), inputs)}")
        self.ModelTag = f"evolvent: {hub}"
        self.stepper, self.hub = stepper, hub
        self._addresses: dict[str, ResultAddress] = {name: stepper.address(name) for name in results}
        self._start, self._last = stepper.time, 0
        self.times: list[float] = []
        self.results: Mapping[str, list[Any]] = {name: [] for name in results}
        self.scStateOutMsg = messaging.SCStatesMsg()
        self.cmdTorqueInMsg = messaging.CmdTorqueBodyMsgReader()
        self.cmdForceBodyInMsg = messaging.CmdForceBodyMsgReader()
        self.cmdForceInertialInMsg = messaging.CmdForceInertialMsgReader()

    def Reset(self, now: int) -> None:  # noqa: N802  (Basilisk's name)
        """Take `now` (ns) as the time of the stepper, and publish its state."""
        self._start, self._last = self.stepper.time - NANO * now, int(now)
        self._publish(now)

    def UpdateState(self, now: int) -> None:  # noqa: N802  (Basilisk's name)
        """Step to `now` (ns) under the commands, and publish the state."""
        if now - self._last >= LEAST:
            force, torque = self._commands()
            self.stepper.set_wrench(self.hub, force.tolist(), torque.tolist())
            self.stepper.step(self._start + NANO * now - self.stepper.time)
            self._last = int(now)
        self._publish(now)

    def _commands(self) -> tuple[np.ndarray, np.ndarray]:
        """Force and torque of the messages, inertial axes."""
        in_body, force = np.zeros((2, 3)), np.zeros(3)
        if self.cmdForceBodyInMsg.isLinked():
            in_body[0] = self.cmdForceBodyInMsg().forceRequestBody
        if self.cmdTorqueInMsg.isLinked():
            in_body[1] = self.cmdTorqueInMsg().torqueRequestBody
        if self.cmdForceInertialInMsg.isLinked():
            force = np.array(self.cmdForceInertialInMsg().forceRequestInertial)
        turned_force, torque = turned(self.stepper.body(self.hub).quaternion[None], in_body[None])[0]
        return force + turned_force, torque

    def _publish(self, now: int) -> None:
        """Write the message, and keep the results."""
        position, velocity, quaternion, rate = self.stepper.body(self.hub)
        back = quaternion * [1.0, -1.0, -1.0, -1.0]
        message = messaging.SCStatesMsgPayload()
        message.r_BN_N, message.v_BN_N = position.tolist(), velocity.tolist()
        message.sigma_BN = modified_rodrigues(quaternion).tolist()
        message.omega_BN_B = turned(back[None], rate[None, None])[0, 0].tolist()
        missing = [np.nan] * 3
        message.r_CN_N, message.v_CN_N, message.omegaDot_BN_B = missing, missing, missing
        message.TotalAccumDVBdy, message.TotalAccumDV_BN_B, message.TotalAccumDV_CN_N = missing, missing, missing
        message.nonConservativeAccelpntB_B = missing
        self.scStateOutMsg.write(message, int(now), self.moduleID)
        if not self.times or NANO * now > self.times[-1]:
            self.times.append(NANO * now)
            for name, address in self._addresses.items():
                self.results[name].append(self.stepper.value(address))


def modified_rodrigues(quaternion: np.ndarray) -> np.ndarray:
    """Modified Rodrigues parameters (3,) of a quaternion (scalar first), of the turn by at most half a revolution."""
    scalar, vector = (quaternion[0], quaternion[1:]) if quaternion[0] >= 0.0 else (-quaternion[0], -quaternion[1:])
    found: np.ndarray = vector / (1.0 + scalar)
    return found
