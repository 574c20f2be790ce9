"""What threads add to the bound of the explicit step. Not compiled: it is evaluated once, before a run."""

import numpy as np

from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.thread.end import add_end_bound
from evolvent.kernels.thread.spool import MOVING, SPRINGS


def _moving_bound(row, body):
    """As `add_thread_bound`, of the elements of a mesh that moves, at the length that is out at the start.

    Notes
    -----
    Of an element with the consistent mass m, stiffness k and damping d alone: 12 k/m and 12 d/m. No mode of the mesh is
    faster than that of its fastest element. Its pull on the body acts through the mass that is left at Q, as that of
    an element that ends there.
    """
    n, length = int(row["n"]), float(row["b"][0])
    m, factor = float(row["density"]) * length / n, float(row["segment"]) * n / length
    J = np.concatenate([row["X"], np.cross(row["d"], row["X"])])
    for what, value in enumerate((row["stiffness"], row["damping"])):
        body[what, int(row["body"])] += 2.0 * factor * value * row["copies"] * np.outer(J, J)
    squared, damping = 12.0 * factor * row["stiffness"] / m, 12.0 * factor * row["damping"] / m
    found = [(float(squared), float(damping))]
    if row["drive"] == FREE_SPOOL:
        compliance = 2.0 * factor * float(row["radius"]) ** 2 / float(row["spool_inertia"])
        found.append((float(compliance * row["stiffness"]), float(compliance * row["damping"])))
    return found


def add_thread_bound(model, p, body, point):
    """Bounds of the fastest modes of thread p, all its nodes taken as released.

    Parameters
    ----------
    body, point : (2, nb, 6, 6), (2, np, 3, 3) float, stiffness and damping felt by bodies and points; the thread's pull
        on what it is fixed to is added

    Returns
    -------
    list of (square of a frequency, rad2/s2; damping rate, 1/s), one a node at most

    Notes
    -----
    Springs: omega^2 <= 4 c/m of a node between two of them, 2 c/m of the tip. Every node is at the spool for a while,
    where the segment may be stiffer by the factor g = l0/S (see `boundary`): (2 + 2 g) c/m and 2 g c/m, and 2 g c of
    what it is fixed to. Segments of fixed length move across themselves only: omega^2 <= 4 T/(m l0), T the tension of
    the whole thread straight at the body's present rate.
    """
    row = model.threads[p]
    first, n, b = int(row["node"]), int(row["n"]), int(row["body"])
    masses = model.nodes["mass"][first : first + n]
    if row["kind"] == MOVING:
        return _moving_bound(row, body)
    if row["kind"] == SPRINGS:
        stiffer = float(row["segment"] / row["shortest"]) if row["shortest"] > 0.0 else 1.0
        ends = 2.0 * stiffer + np.where(np.arange(n) > 0, 2.0, 0.0)
        if row["end"] >= 0:
            add_end_bound(model, row, 2.0 * stiffer, body, point)
            ends, masses = ends[1:], masses[1:]
        J = np.concatenate([row["X"], np.cross(row["d"], row["X"])])
        for what, value in enumerate((row["stiffness"], row["damping"])):
            body[what, b] += 2.0 * stiffer * value * row["copies"] * np.outer(J, J)
        squared, damping = ends * row["stiffness"] / masses, ends * row["damping"] / masses
        if row["drive"] == FREE_SPOOL:
            compliance = 2.0 * stiffer * float(row["radius"]) ** 2 / float(row["spool_inertia"])
            squared = np.append(squared, compliance * row["stiffness"])
            damping = np.append(damping, compliance * row["damping"])
        return [(float(k), float(d)) for k, d in zip(squared, damping, strict=True)]
    rate2 = float(np.sum(model.bodies["w"][b] ** 2))
    rate2 += sum(float(np.abs(np.linalg.eigvalsh(field["K"])).max()) for field in model.fields)
    distance = float(np.linalg.norm(row["d"])) + row["segment"] * (n - np.arange(n))
    tension = np.cumsum(masses * (rate2 * distance + float(np.linalg.norm(model.info.gravity))))
    lighter = np.minimum(masses, np.roll(masses, -1))
    return [(4.0 * float(np.max(tension / lighter)) / float(row["segment"]), 0.0)]
