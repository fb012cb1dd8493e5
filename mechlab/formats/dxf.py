"""DXF: named curves as polylines, in the oldest form (R12) that every drawing program reads. Lengths in metres."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError

CLOSED, SPATIAL = 1, 8  # flags of a POLYLINE (group code 70)


def dxf_polylines(curves: Mapping[str, ArrayLike]) -> str:
    """A DXF R12 text with one polyline for each curve (n, 2) or (n, 3), on a layer of its name.

    A curve that ends where it starts is closed. 17 significant digits. Raises MechlabError for fewer than two points, or
    values that are not finite.
    """
    lines: list[str] = ["0", "SECTION", "2", "HEADER", "9", "$ACADVER", "1", "AC1009", "0", "ENDSEC"]
    lines += ["0", "SECTION", "2", "ENTITIES"]
    for name, curve in curves.items():
        points = np.asarray(curve, dtype=float)
        if points.ndim != 2 or points.shape[0] < 2 or points.shape[1] not in (2, 3) or not np.all(np.isfinite(points)):
            raise MechlabError(
                f"curve {name!r}: expected two or more finite points (n, 2) or (n, 3), got shape {points.shape}."
            )
        size = float(np.max(np.ptp(points, axis=0)))
        closed = bool(len(points) > 2 and np.max(np.abs(points[0] - points[-1])) <= 1e-9 * size)
        flags = (CLOSED if closed else 0) + (SPATIAL if points.shape[1] == 3 else 0)
        layer = "".join(c if c.isalnum() or c in "_-$" else "_" for c in name)[:31] or "curve"
        lines += ["0", "POLYLINE", "8", layer, "66", "1", "70", str(flags)]
        for point in points[:-1] if closed else points:
            xyz = (*point.tolist(), 0.0)[:3]
            lines += ["0", "VERTEX", "8", layer]
            for code, value in zip(("10", "20", "30"), xyz, strict=True):
                lines += [code, repr(value)]
            if flags & SPATIAL:
                lines += ["70", "32"]
        lines += ["0", "SEQEND", "8", layer]
    return "\n".join([*lines, "0", "ENDSEC", "0", "EOF", ""])
