"""Figure and numbers of the guide "Design": `python docs/images/design.py` writes and prints them."""

import pathlib
import time

import evolvent

HERE = pathlib.Path(__file__).parent
HINGES = (1, 2, 3)

if __name__ == "__main__":
    began = time.perf_counter()
    found = evolvent.optimize(
        "solar-array",
        vary={f"parts.hinge {k}.{key}": "20% to 300%" for key in ("stiffness", "damping") for k in HINGES},
        minimize=[f"hinge {k}.latch_work" for k in HINGES],
        subject_to=["margin >= 0", *(f"hinge {k}.latch_time <= 20 s" for k in HINGES)],
        workers=None,
    )
    print(found)
    print(f"{time.perf_counter() - began:.0f} s")
    found.plot(HERE / "design.png")
