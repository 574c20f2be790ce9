"""Digests of the models and start states of cases and of a system at odd angles; run by `unit/test_processor.py`.

``python start_states.py`` writes them as JSON: of each case the arrays of its model and its state, by name.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent import System, cases, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.compiled.pointer import Struct

#: Of the built-in cases those with beams, threads, coils and rods. The stand starts from an equilibrium (LAPACK).
CASES = ("boom-slew", "spinning-tether", "two-booms", "solar-array", "wrapped-rib-deploy", "yo-yo-despin")
ALONG, ACROSS, TURN = (0.3, -0.5, 0.7), (0.5, 0.3, 0.0), (0.5, -0.5, 0.7, 0.1)
BAR = elements.Rectangle(thickness=0.011, width=0.017)
SOFT = elements.Material(young_modulus=7.3e9, poisson_ratio=0.3, density=1900.0, thermal_expansion=2.3e-5)


def at_odd_angles() -> System:
    """Bodies, beams of all formulations, rods and what connects them, nothing of it along an axis."""
    system = System(gravity=(0.1, -0.2, -9.7))
    body = {"mass": 3.1, "inertia": (1.1, 1.3, 0.9), "orientation": TURN}
    system.add(parts.RigidBody(**body, angular_velocity=(0.1, 0.3, -0.2)), "hub")
    system.add(parts.RigidBody(**body, motion="spin", axis=ALONG, rate=0.3, position=(0.2, 0.1, 0.7)), "wheel")
    line = {"length": 1.3, "section": BAR, "material": SOFT, "elements": 4, "direction": ALONG, "normal": ACROSS}
    for name in (*elements.FORMULATIONS, "cable", "cable_stretch"):
        own = {key: value for key, value in line.items() if key != "normal" or not name.startswith("cable")}
        system.add(parts.Beam(**own, formulation=name, position=(0.1, 0.2, 0.3)), name)
    system.add(parts.Joint(a="hub", b="assumed_strain.root", type="clamp"), "clamp")
    system.add(parts.Joint(a="hub", b="cable.root", type="spherical"), "ball")
    system.add(parts.Joint(a="hub", b="nu_split.root", type="revolute", axis=ACROSS), "hinge")
    system.add(parts.JointSpring(joint="hinge", stiffness=2.1), "torsion")
    system.add(parts.Rod(**line, curvature=(0.4, 0.2, -0.3)), "rod")
    system.add(parts.Joint(a="hub", b="rod.root", type="clamp"), "foot")
    warm = [(0.0, 0.0), (1.0, 31.0)]
    system.add(parts.ThermalLoad(part="rod", temperature=warm, along=[(0.0, 0.3), (1.0, 1.1)]), "warm rod")
    system.add(parts.ThermalLoad(part="assumed_strain", temperature=warm, gradient_y=warm), "warm beam")
    system.add(parts.Point(mass=0.3, position=(1.3, -0.4, 0.9)), "mass")
    system.add(parts.Spring(a=("hub", (0.1, 0.2, 0.3)), b="mass", stiffness=12.0), "spring")
    system.add(parts.Load(at="mass", direction=ALONG, profile={"constant": 0.3}), "push")
    return system


def arrays(struct: Struct, path: str) -> Iterator[tuple[str, Any]]:
    """Names and values of the arrays and records of a struct; addresses, which are each process's own, are left out."""
    for name in type(struct)._fields:
        value = getattr(struct, name)
        if isinstance(value, Struct):
            yield from arrays(value, f"{path}{name}.")
        elif name != "addresses":
            value = np.atleast_1d(np.array(value))
            for field in value.dtype.names or ():
                if field != "law":
                    yield f"{path}{name}.{field}", value[field]
            if not value.dtype.names:
                yield f"{path}{name}", value


def digests(assembly: Assembly) -> dict[str, str]:
    """A hash of each array of an assembly; -0.0 counts as 0.0."""
    found = {"y": assembly.y, "s": assembly.s, **dict(arrays(assembly.model, ""))}
    return {
        name: hashlib.sha256(np.ascontiguousarray(value + 0 if value.dtype.kind == "f" else value)).hexdigest()[:16]
        for name, value in found.items()
    }


def main() -> None:
    """Write the digests of all."""
    loaded = {name: cases.load(name) for name in CASES}
    found = {name: cases.system(case.system).assembled(case, {})[0] for name, case in loaded.items()}
    found["at odd angles"] = at_odd_angles().assemble()
    json.dump({name: digests(assembly) for name, assembly in found.items()}, sys.stdout)


if __name__ == "__main__":
    main()
