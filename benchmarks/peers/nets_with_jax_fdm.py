"""jax-fdm: forms of nets and derivatives of their errors, for `tests/nets/test_net_forms.py`.

In an environment of its own: `pip install jax-fdm==0.14.1`, then
`python benchmarks/peers/nets_with_jax_fdm.py tests/nets/data/jax_fdm.json PYTHON`, where PYTHON is that of an
environment with evolvent, which finds the form of the larger net in the same run.
"""

from __future__ import annotations

import importlib.metadata
import json
import pathlib
import statistics
import subprocess
import sys
import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax_fdm.equilibrium import (
    EquilibriumModelSparse,
    EquilibriumParametersState,
    EquilibriumStructureSparse,
    LoadState,
)
from net_on_ribs import FOCAL, facets, problem

#: E A of a cord, N, and its force density, N/m, of the elastic net.
STIFFNESS, DENSITY = 2e4, 10.0
#: Points and weights on a triangle, exact up to the degree 6 (Dunavant 1985): of three permutations, and of six.
THREE = ((0.249286745170910, 0.116786275726379), (0.063089014491502, 0.050844906370207))
SIX = (0.310352451033784, 0.636502499121399, 0.082851075618374)
#: Repetitions whose median is the time.
REPEATS = 21

#: The same form in evolvent: reads the net, writes nodes and the median of the times, s.
BESIDE = """
import json, statistics, sys, time
import numpy as np
from evolvent.nets.form import find_form
from evolvent.nets.topology import Topology
given = json.load(sys.stdin)
x, cords, rim = np.array(given["nodes"]), np.array(given["cords"]), np.array(sorted(given["rim"]))
facets = np.zeros((0, 3), dtype=int)
topology = Topology(x[:, :2], cords, facets, rim, np.zeros(len(cords), dtype=bool))
density, times = np.array(given["density"]), []
for _ in range(given["repeats"] + 1):
    began = time.perf_counter()
    found = find_form(topology, x[rim], density)
    times.append(time.perf_counter() - began)
print(json.dumps({"x": found.tolist(), "seconds": statistics.median(times[1:])}))
"""


class Form:
    """The form of a net as a compiled function of its force densities."""

    def __init__(self, given: dict[str, Any], loads: list[float]) -> None:
        nodes, self.cords = np.array(given["nodes"]), np.array(given["cords"])
        supports = np.isin(np.arange(len(nodes)), given["rim"]).astype(int)
        structure = EquilibriumStructureSparse(np.arange(len(nodes)), self.cords, supports)
        fixed = jnp.array(nodes[np.array(structure.indices_fixed)])
        load = LoadState(jnp.zeros((len(nodes), 3)).at[:, 2].set(jnp.array(loads)), 0.0, 0.0)
        model = EquilibriumModelSparse(tmax=1)
        self.state = jax.jit(lambda q: model(EquilibriumParametersState(q, fixed, load), structure))

    def lengths(self, q: jax.Array) -> jax.Array:
        """Lengths of the cords (m,), m, by their force densities, N/m."""
        return jnp.ravel(self.state(q).lengths)


def half_path(x: jax.Array) -> jax.Array:
    """Rms of the half path error, m, of the facets of the net."""
    points, weights = [], []
    for a, w in THREE:
        points += [(1.0 - 2.0 * a, a, a), (a, 1.0 - 2.0 * a, a), (a, a, 1.0 - 2.0 * a)]
        weights += [w] * 3
    a, b, w = SIX
    c = 1.0 - a - b
    points += [(a, b, c), (a, c, b), (b, a, c), (b, c, a), (c, a, b), (c, b, a)]
    weights += [w] * 6
    corners = x[np.array(facets())]
    p = jnp.einsum("pc,kcd->kpd", jnp.array(points), corners)
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * jnp.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    square = p[..., 0] ** 2 + p[..., 1] ** 2
    error = (p[..., 2] - square / (4.0 * FOCAL)) / (1.0 + square / (4.0 * FOCAL**2))
    share = area[:, None] * jnp.array(weights) / sum(weights)
    return jnp.sqrt(jnp.sum(share * error**2) / jnp.sum(area))


def elastic(given: dict[str, Any]) -> dict[str, Any]:
    """The rms of the net without loads and its derivatives by the lengths to which its elastic cords are cut.

    The force densities of an elastic net are those with q = EA (1/l0 - 1/l(q)): their derivatives by l0 follow from
    those of the lengths l by q, which are differentiated automatically, as that of the rms is.
    """
    form = Form(given, [0.0] * len(given["nodes"]))
    q = jnp.full(len(given["cords"]), DENSITY)
    length, pull = jax.vjp(form.lengths, q)
    natural = length / (1.0 + q * length / STIFFNESS)
    rms, by_q = jax.value_and_grad(lambda at: half_path(form.state(at).xyz))(q)
    by_length = jnp.stack([pull(row)[0] for row in jnp.eye(len(q))])  # its sparse solver takes one row at a time
    own = jnp.eye(len(q)) - (STIFFNESS / length**2)[:, None] * by_length
    slopes = jnp.linalg.solve(own.T, by_q) * (-STIFFNESS / natural**2)
    return {"facets": facets(), "rms": float(rms), "natural": natural.tolist(), "by_natural": slopes.tolist()}


def times(python: str) -> dict[str, float]:
    """Seconds in which both find the form of a net of 600 nodes, compiled before, and what their nodes differ by, m."""
    given = problem(ribs=20, stations=9)
    form, q = Form(given, [0.0] * len(given["nodes"])), jnp.array(given["density"])
    x, found = form.state(q).xyz.block_until_ready(), []
    for _ in range(REPEATS):
        began = time.perf_counter()
        form.state(q).xyz.block_until_ready()
        found.append(time.perf_counter() - began)
    sent = json.dumps({**given, "repeats": REPEATS})
    answer = subprocess.run([python, "-c", BESIDE], input=sent, capture_output=True, text=True, check=True)
    beside = json.loads(answer.stdout)
    own = statistics.median(found)
    return {
        "nodes": len(given["nodes"]), "jax_fdm": own, "evolvent": beside["seconds"], "ratio": own / beside["seconds"],
        "off": float(np.abs(np.asarray(x) - beside["x"]).max()),
    }  # fmt: skip


def main(path: str, python: str) -> None:
    """Write the problem with its solution."""
    given = problem()
    state = Form(given, given["loads"]).state(jnp.array(given["density"]))
    made = {
        "made by": f"jax-fdm {importlib.metadata.version('jax-fdm')}", **given,
        "x": np.asarray(state.xyz).tolist(), "tension": np.ravel(state.forces).tolist(),
        "elastic": elastic(given), "seconds": times(python),
    }  # fmt: skip
    pathlib.Path(path).write_text(json.dumps(made) + "\n", encoding="utf-8")
    print(made["seconds"])


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
