"""Write the crease pattern of the case `miura-sheet`: `python tools/miura_pattern.py`."""

from evolvent.elements import fold_files

if __name__ == "__main__":
    path = fold_files.SHIPPED / "miura-8x8.fold"
    fold_files.write_miura(str(path), facets=(8, 8), sides=(0.125, 0.125), angle=60.0)
