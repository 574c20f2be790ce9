"""Shells against stored values of Kratos Multiphysics on the same meshes (benchmarks/shell_peers.py wrote them)."""

from __future__ import annotations

import importlib.util
import json
import pathlib
import sys
from typing import Any

import numpy as np
import pytest

from book import Book

ROOT = pathlib.Path(__file__).parents[2]
CHAPTER = "Statics of shells"


@pytest.fixture(scope="module")
def kratos() -> Any:
    """Values of Kratos, with its version, meshes and elements."""
    path = pathlib.Path(__file__).parent / "data" / "kratos.json"
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def peers() -> Any:
    """The works that both programs solve, and the module that solves them here."""
    found = []
    for name in ("shell_works", "shells_with_evolvent"):
        spec = importlib.util.spec_from_file_location(name, ROOT / "benchmarks" / "peers" / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules.setdefault(name, module)
        spec.loader.exec_module(module)
        found.append(module)
    return found


#: Largest difference over the largest displacement, on the same coarse mesh.
ALLOWED = {"cantilever, end force of 4": 1e-3, "roll-up to a circle": 5e-4, "open cylinder pulled by 40000": 8e-3}


@pytest.mark.parametrize("name", [pytest.param(name, id=name.partition(",")[0]) for name in ALLOWED])
def test_both_programs_have_the_same_equilibrium(kratos: Any, peers: Any, book: Book, name: str) -> None:
    """Thick corotational elements (Reissner, Mindlin; MITC4) on the same nodes."""
    works, ours = peers
    work = works.STATIC[name]
    mesh = work["meshes"][0]
    row = next(one for one in kratos["static"] if one["work"] == name and tuple(one["mesh"]) == mesh)
    found = ours.static(work["build"](mesh), {"steps": work["evolvent"]})()
    wanted = np.array(row["values"])
    book(
        CHAPTER, f"{name} ({mesh[0]} x {mesh[1]}), beside a second code", reference="the same mesh",
        source=f"Kratos {kratos['version']}, thick corotational shell",
        error=np.abs(np.array(found["values"]) - wanted).max() / np.abs(wanted).max(), allowed=ALLOWED[name],
    )  # fmt: skip


def test_both_programs_swing_a_plate_alike(kratos: Any, peers: Any, book: Book) -> None:
    """The tip of a plate held at one corner, 16 x 16 elements, against the limit of 4 x 4 and 8 x 8 in Kratos."""
    works, ours = peers
    coarse, fine = (np.array(row["places"]) for row in kratos["plate"])
    limit = fine + (fine - coarse) / 3.0
    spec = {**works.plate(16), "samples": kratos["samples"]}
    found = np.array(ours.dynamic(spec, {"method": "energy-momentum"}, 1e-3)()["places"])
    book(
        "Dynamics", "Swinging plate held at a corner (16 x 16), beside a second code",
        reference="limit of 4 x 4 and 8 x 8", source=f"Kratos {kratos['version']}, thick corotational shell",
        error=np.linalg.norm(found - limit, axis=1).max() / np.abs(limit[-1, 2]), allowed=6e-3,
    )  # fmt: skip
