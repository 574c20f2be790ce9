"""PNG files of drawn figures, whose rows are compressed as they are.

Pillow chooses a filter for every row, which serves photographs: of figures, whose rows are of a few colours, that takes
twice the time of the compression and saves nothing.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

#: Compression: of the levels up to 9 the one of least time.
_LEVEL = 1
#: Bits of a colour, the kind of a pixel with three of them, and the unit of pixels per metre.
_BITS, _RGB, _PER_METRE = 8, 2, 1
_INCH = 0.0254


def encoded(points: np.ndarray, dpi: float) -> bytes:
    """Points (height, width, 3) uint8, so many of them in an inch, as the content of a file."""
    height, width, _ = points.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # each begins with its filter, 0 for none
    rows[:, 1:] = points.reshape(height, -1)
    density = round(dpi / _INCH)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, _BITS, _RGB, 0, 0, 0)),
        (b"pHYs", struct.pack(">IIB", density, density, _PER_METRE)),
        (b"IDAT", zlib.compress(rows.data, _LEVEL)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
        for name, content in chunks
    )
