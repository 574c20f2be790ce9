"""What limits a result: where states leave the range in which a model of a part holds.

`limitations` is asked of every result that has states: runs, equilibria, modes, linear models and what is made of them.
"""

from __future__ import annotations

import numpy as np

from evolvent.elements.sections import TapeSection
from evolvent.elements.shapes import Strip
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.parts.reduced_body import ReducedBody
from evolvent.parts.rod import Rod
from evolvent.solvers.common.solution import Solution

#: Share by which a rate or a rotation may change what the linear model of a reduced body has, before it is reported.
LINEAR = 0.01
#: Stretch of a beam's axis beyond which Green's strain with a constant modulus is reported.
GREEN = 0.05


def limitations(solution: Solution) -> list[str]:
    """Sentences on what the states of a solution are beyond, each with the part, the time, the value and what helps."""
    if not solution.t.size:
        return []
    return [
        text
        for rule in (of_reduced_models, beyond_small, beyond_tension, beyond_green, without_length)
        if (text := rule(solution))
    ]


def limitation_of(solution: Solution) -> str:
    """`limitations` of the last state as one text; '' for none."""
    return "; ".join(limitations(solution.chosen(slice(-1, None))))


def of_reduced_models(solution: Solution) -> str:
    """What the structures were beyond from which the models of reduced bodies have been made; '' for nothing."""
    parts = solution.assembly.parts.items()
    own = {name: part.model.warning for name, part in parts if isinstance(part, ReducedBody)}
    return "; ".join(f"the model of {name!r} was made where {warning}" for name, warning in own.items() if warning)


def without_length(solution: Solution) -> str:
    """A sentence on springs that the motion has brought to length zero by the last state; '' for none."""
    first, last = float(solution.t[0]), float(solution.t[-1])
    return "; ".join(text for time, text in solution.passages if time <= last and (time > first or len(solution.t) > 1))


def beyond_green(solution: Solution) -> str:
    """A sentence on beams whose axis is stretched by more than `GREEN` under Green's strain; '' of others.

    Notes
    -----
    A stretch x has Green's strain x + x^2/2 and the force E A (1 + x)(x + x^2/2), 3 x/2 above E A x.
    """
    found, model = [], solution.assembly.model
    for name, (family, index) in solution.assembly.names.items():
        if family != "beams":
            continue
        row = model.beams[index]
        first, last = int(row["first_element"]), int(row["first_element"]) + int(row["elements"])
        if np.all(model.elements["stretch"][first:last] != 0):
            continue
        vectors, nodes = NODE_VECTORS[row["kind"]], int(row["nodes"])
        q = solution.y[:, int(row["iq"]) : int(row["iq"]) + 3 * vectors * nodes].reshape(-1, nodes, vectors, 3)
        if vectors == 2:
            stretch = np.linalg.norm(q[:, :, 1], axis=2) - 1.0
        else:
            chord = np.linalg.norm(np.diff(q[:, :, 0], axis=1), axis=2)
            stretch = chord / model.elements["length"][first:last] - 1.0
        size = np.abs(stretch) if vectors == 2 else np.maximum(stretch, 0.0)
        if size.max() > GREEN:
            n, k = np.unravel_index(int(size.argmax()), size.shape)
            found.append(
                f"the axis of {name!r} is strained by {100.0 * stretch[n, k]:.3g} % at t = {solution.t[n]:.6g} s: by "
                f"Green's strain its axial force is off by about {150.0 * abs(stretch[n, k]):.2g} %; use the "
                f"formulation 'cable_stretch' or a Rod"
            )
    return "; ".join(found)


def beyond_tension(solution: Solution) -> str:
    """A sentence on rods whose tension is above 12 E I/L^2 of an element, where their shape is unstable; '' of others.

    Notes
    -----
    The tension follows from the chords of the elements, of which bending leaves out a little. The residual bending
    flexibility is one of shear (`evolvent.elements.rods`), and a rod that shears buckles under such a tension.
    """
    found, model = [], solution.assembly.model
    for name, part in solution.assembly.parts.items():
        if not isinstance(part, Rod) or isinstance(part.section, Strip) or not solution.t.size:
            continue
        if part.payout is not None:  # whose elements have no residual flexibility
            continue
        row = model.rods[solution.assembly.index(name)]
        first = int(row["first_element"])
        own = model.rod_elements[first : first + int(row["elements"])]
        bodies, arms = np.append(own["a"], own["b"][-1]), np.vstack([own["arm_a"], own["arm_b"][-1]])
        nodes = _places(solution.y, model.bodies["iq"][bodies], arms)
        strain = np.linalg.norm(np.diff(nodes, axis=1), axis=2) / own["length"] - own["rest"][:, 0]
        strain[:, own["heated"] != 0] = 0.0  # whose strain is not that of tension alone
        bends = own["section"][:, 4, 4]
        if not isinstance(part.section, TapeSection):
            bends = np.maximum(bends, own["section"][:, 5, 5])
        limit = 12.0 / (bends * own["length"] ** 2)
        share = strain / own["section"][:, 0, 0] / limit
        if share.size and share.max() > 1.0:
            n = int(np.argmax(share.max(axis=1) > 1.0))  # the first; its chords turn away later
            k = int(share[n].argmax())
            found.append(
                f"{name!r} has a tension of {share[n, k] * limit[k]:.3g} N in element {k} at t = "
                f"{solution.t[n]:.6g} s, above 12 E I/L^2 = {limit[k]:.3g} N, beyond which its shape is unstable; use "
                f"shorter elements, the section 'strip' or a Thread"
            )
    return "; ".join(found)


def _places(y: np.ndarray, iq: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """Places (nt, n, 3) of points on bodies whose coordinates, position and quaternion, start at iq (n,)."""
    found: np.ndarray = y[:, iq[:, None] + np.arange(3)]
    off = np.flatnonzero(np.any(arms != 0.0, axis=1))
    if off.size:  # whose rotation counts
        attitude = y[:, iq[off, None] + 3 + np.arange(4)]
        attitude /= np.linalg.norm(attitude, axis=2, keepdims=True)
        across = 2.0 * np.cross(attitude[..., 1:], arms[off])
        found[:, off] += arms[off] + attitude[..., :1] * across + np.cross(attitude[..., 1:], across)
    return found


def beyond_small(solution: Solution) -> str:
    """A sentence on reduced bodies that turn too fast, or deform too much, for their linear models; '' of others.

    Notes
    -----
    What is left out of the stiffness is of the order of (rate/lowest frequency with a node held)^2, and displacements
    are off by half the square of the rotations.
    """
    found = []
    for name, part in solution.assembly.parts.items():
        if not isinstance(part, ReducedBody) or not solution.t.size:
            continue
        row, axes = solution.assembly.model.reduced_bodies[solution.assembly.index(name)], part.axes
        iv = int(solution.assembly.model.bodies["iv"][row["first_body"]])
        rate = np.linalg.norm(solution.y[:, iv + 3 : iv + 6], axis=1)
        share = (rate / axes.held) ** 2
        if share.max() > LINEAR:
            k = int(share.argmax())
            found.append(
                f"{name!r} turns at {rate[k]:.3g} rad/s at t = {solution.t[k]:.6g} s, {rate[k] / axes.held:.2g} of its "
                f"lowest frequency with a node held: stiffening and loads by spin, which its linear model does not "
                f"have, change it by about {100.0 * share[k]:.2g} %; use a Rod or a Beam"
            )
        q = solution.y[:, int(row["iq"]) :][:, : int(row["modes"])]
        turns = (q @ axes.shapes[: 6 * int(row["nodes"])].T).reshape(len(q), -1, 6)[..., 3:]
        largest = float(np.abs(turns).max(initial=0.0))
        if 0.5 * largest**2 > LINEAR:
            found.append(
                f"{name!r} turns its nodes by {np.degrees(largest):.3g} deg against its frame: its displacements are "
                f"off by about {50.0 * largest**2:.2g} %, since its model is linear; use a Rod or a Beam"
            )
    return "; ".join(found)
