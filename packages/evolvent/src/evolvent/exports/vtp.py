"""Files that ParaView reads: polygonal data (.vtp), compressed, and collections of them in time (.pvd).

Sources: VTK XML file formats, Kitware (appended raw data, compressed by zlib); ParaView's collection files.
"""

from __future__ import annotations

import os
import pathlib
import zlib
from collections.abc import Iterable, Mapping
from xml.sax.saxutils import quoteattr

import numpy as np

#: Level of the compression: higher ones take twice the time for some percent.
_LEVEL = 6
#: Cells of polygonal data: name of the element, and of their number.
VERTS, LINES, POLYS = "Verts", "Lines", "Polys"
#: Types of numbers.
_TYPES = {"f8": "Float64", "i4": "Int32"}


def write(
    path: str, points: np.ndarray, cells: str, connectivity: np.ndarray, sizes: np.ndarray,
    point_data: Mapping[str, np.ndarray], cell_data: Mapping[str, np.ndarray],
) -> None:  # fmt: skip
    """Write polygonal data.

    Parameters
    ----------
    points : (n, 3) float, m
    cells : `VERTS`, `LINES` or `POLYS`
    connectivity : int, numbers of the points of all cells
    sizes : (c,) int, how many points each cell has
    point_data, cell_data : mapping, name -> (n,), (n, 3) or (c,) values
    """
    blocks: list[bytes] = []
    at = 0

    def array(name: str, values: np.ndarray) -> str:
        nonlocal at
        kind = "f8" if values.dtype.kind == "f" else "i4"
        block = _compressed(np.ascontiguousarray(values, dtype=f"<{kind}"))
        width = values.shape[1] if values.ndim == 2 else 1
        entry = f'<DataArray type="{_TYPES[kind]}" Name={quoteattr(name)} NumberOfComponents="{width}"'
        entry += f' format="appended" offset="{at}"/>'
        blocks.append(block)
        at += len(block)
        return entry

    def element(name: str, arrays: Mapping[str, np.ndarray], **attributes: str) -> list[str]:
        head = "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())
        return [f"<{name}{head}>", *(array(key, values) for key, values in arrays.items()), f"</{name}>"]

    counts = {f"NumberOf{kind}": len(sizes) if kind == cells else 0 for kind in (VERTS, LINES, "Strips", POLYS)}
    numbers = "".join(f' {key}="{value}"' for key, value in counts.items())
    of_cells = {"connectivity": connectivity, "offsets": np.cumsum(sizes)}
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor">',
        "<PolyData>",
        f'<Piece NumberOfPoints="{len(points)}"{numbers}>',
        *element("Points", {"points": points}),
        *element(cells, of_cells),
        *element("PointData", point_data, **_active(point_data)),
        *element("CellData", cell_data, **_active(cell_data)),
        "</Piece>",
        "</PolyData>",
        '<AppendedData encoding="raw">',
    ]
    content = ["\n".join(lines).encode(), b"\n_", *blocks, b"\n</AppendedData>\n</VTKFile>\n"]
    pathlib.Path(path).write_bytes(b"".join(content))


def _active(data: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Attributes that name the first scalar and the first vector."""
    found = {}
    for key, ndim in (("Scalars", 1), ("Vectors", 2)):
        name = next((name for name, values in data.items() if values.ndim == ndim), None)
        if name is not None:
            found[key] = name
    return found


def _compressed(values: np.ndarray) -> bytes:
    """Values with their header: number of blocks, size of a block, of the last one if less, and the compressed size."""
    data = values.tobytes()
    if not data:
        return np.zeros(3, dtype="<u8").tobytes()
    packed = zlib.compress(data, _LEVEL)
    return np.array([1, len(data), 0, len(packed)], dtype="<u8").tobytes() + packed


def write_collection(path: str, files: Iterable[tuple[float, str]]) -> None:
    """Write a collection: times (s) and files, which are named relative to its folder, on every system with '/'."""
    folder = os.path.dirname(os.path.abspath(path))
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">']
    lines.append("<Collection>")
    for time, name in files:
        relative = os.path.relpath(os.path.abspath(name), folder).replace(os.sep, "/")
        lines.append(f'<DataSet timestep="{float(time)!r}" group="" part="0" file={quoteattr(relative)}/>')
    lines += ["</Collection>", "</VTKFile>", ""]
    pathlib.Path(path).write_text("\n".join(lines), encoding="utf-8")
