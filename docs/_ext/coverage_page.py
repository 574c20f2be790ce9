"""The page on coverage of the truth, from the numbers that `benchmarks/coverage_of_truth.py` has counted."""

from __future__ import annotations

import json
import pathlib
from typing import Any

COUNTED = pathlib.Path(__file__).resolve().parents[1] / "coverage.json"
_INTRODUCTION = """# Coverage of the truth

How often the truth lies within two stated standard uncertainties of the result of `evolvent identify`. Motions are
simulated by equations of their own: sin θ of a pivot, the lift of a body on wires, full geometry of a body on springs.
Bodies, amplitudes, phases, damping, rates and disturbances are drawn again for each repetition. All inputs of the stand
are exact, so that u is that of the signals alone. 95.4 % are expected of a normal distribution; with n
repetitions such a share
is itself uncertain by 21 % / √n, that is 1.5 % with 200.

- *refused*: recordings that are answered by one sentence in place of a number.
- *within 2 u*: of those evaluated, the share whose truth lies inside.
- *warned*: of those evaluated, the share with a warning that names the cause.
- *silent*: of all, the share that misses by more than 2 u without such a warning.
- *u* and *|error| / u* are medians.
"""


def page(path: pathlib.Path = COUNTED) -> str:
    """The page in Markdown."""
    counted: dict[str, dict[str, dict[str, Any]]] = json.loads(path.read_text(encoding="utf-8"))
    lines = [_INTRODUCTION]
    for stand, rows in counted.items():
        lines += [
            f"## {stand.capitalize()}\n",
            "| disturbance | n | refused, % | within 2 u, % | warned, % | silent, % | u, relative | \\|error\\| / u |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for row in rows.values():
            shares = [row[key] for key in ("refused", "inside", "named", "silent")]
            cells = [row["what"], str(row["repetitions"]), *("" if x is None else f"{100.0 * x:.1f}" for x in shares)]
            cells += ["" if row[key] is None else f"{row[key]:.2g}" for key in ("relative_u", "ratio")]
            lines.append(f"| {' | '.join(cells)} |")
        lines.append("")
    return "\n".join(lines)
