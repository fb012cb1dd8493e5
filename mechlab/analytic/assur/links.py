"""Any planar linkage of rigid links, pins and slides as data, and its loop equations: groups of class II to VI alike.

Point P of link j stands at p_j + c_jP z_j, z_j = e^(i theta_j); a pin says that a point of several links, or of the ground, is one. A slide
holds a point on a line of a link k or of the ground: it stands at p_k + a z_k + d y, y = s z_k, s its place on the line. That is linear in
p, z and y; what annihilates p leaves one complex equation for each independent loop,

    sum_j A_lj z_j + sum_s B_ls y_s = r_l,   |z_j| = 1,   y_s conj(z_k) real,   l = 1 .. L,

in n unknown turns and places. A group (with the drives, links whose angle is given) is determinate where n = 2 L.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from mechlab.analytic.assur.bilinear import path_count
from mechlab.analytic.assur.plane import Complex
from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass

GROUND = "ground"
LARGEST_LOOPS = 5
"""252 paths."""
FIXED_GUIDE = -1
"""Guide of a slide that is the ground; -2 - k: the drive k."""


@dataclass(frozen=True)
class Slide:
    """A point that lies on a straight line of the link `guide`, or of the ground: the line goes through `through` along `along`, complex in
    the axes of the guide [m]; the length of `along` does not matter."""

    point: str
    guide: str
    through: complex
    along: complex

    def __post_init__(self) -> None:
        if not abs(self.along) > 0.0:
            raise MechlabError(f"linkage: the slide of {self.point!r} on {self.guide!r} has no direction.")


@dataclass(frozen=True)
class Links:
    """Links with their points in their own axes (complex, x + iy [m]), fixed points of the ground, the driven links by name, and slides."""

    links: Mapping[str, Mapping[str, complex]]
    fixed: Mapping[str, complex]
    drives: tuple[str, ...]
    slides: Mapping[str, Slide] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.drives:
            if name not in self.links:
                raise unknown("linkage: driven link", name, self.links)
        if GROUND in self.links:
            raise MechlabError(f"linkage: {GROUND!r} is not a link; its points are the fixed ones.")
        for name, slide in self.slides.items():
            if name in self.links:
                raise MechlabError(f"linkage: {name!r} is a link and a slide; expected two names.")
            if slide.guide != GROUND and slide.guide not in self.links:
                raise unknown(f"linkage: guide of {name!r}", slide.guide, (*self.links, GROUND))
            if self.holder(slide) is None:
                raise unknown(f"linkage: point of {name!r} off its guide {slide.guide!r}", slide.point, self.points)
        guides = {s.guide for s in self.slides.values()}
        lone = [n for n, points in self.links.items() if n not in guides and not any(self.shared(p) > 1 for p in points)]
        if lone:
            raise MechlabError(f"linkage: link {lone[0]!r} hangs on nothing: it shares no point with another link or the ground.")

    def shared(self, point: str) -> int:
        """Number of links, of the ground and of slides that have the point."""
        return sum(point in points for points in self.links.values()) + (point in self.fixed) + self._sliding(point)

    def _sliding(self, point: str) -> int:
        return sum(s.point == point for s in self.slides.values())

    def holder(self, slide: Slide) -> str | None:
        """The first link, or the ground, that has the point of a slide and is not its guide."""
        if slide.point in self.fixed and slide.guide != GROUND:
            return GROUND
        return next((n for n, points in self.links.items() if slide.point in points and n != slide.guide), None)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Links whose turn is not given."""
        return tuple(n for n in self.links if n not in self.drives)

    @property
    def quantities(self) -> tuple[str, ...]:
        """What is to be found: turns of the links that are not driven, then the places of the slides."""
        return (*self.unknowns, *self.slides)

    @property
    def points(self) -> tuple[str, ...]:
        """All points, each once."""
        return tuple(dict.fromkeys([*self.fixed, *(p for points in self.links.values() for p in points)]))

    @property
    def size(self) -> float:
        """Largest distance in a link or of the ground from its origin [m], the measure for misfits."""
        every = [abs(c) for points in self.links.values() for c in points.values()] + [abs(c) for c in self.fixed.values()]
        every += [abs(s.through) for s in self.slides.values()]
        return max([*every, 1e-300])


@dataclass(frozen=True)
class Loops:
    """The loop equations known @ z_known + free @ (z, y / size) = right; origins = back_right - back @ (z of all links, y / size).

    turning: how many of the unknowns are turns, the first ones; guides: for each slide the place of its guide among them, or FIXED_GUIDE
    for the ground, or -2 - k for the drive k. size [m] makes the places of slides numbers of the size of 1.
    """

    free: Complex
    known: Complex
    right: Complex
    back: Complex
    back_right: Complex
    turning: int
    guides: tuple[int, ...]
    size: float


def loops(linkage: Links) -> Loops:
    """The loop equations of a linkage. Raises MechlabError where drives and loops do not determine all turns."""
    names, slides, size = list(linkage.links), list(linkage.slides), linkage.size
    rows: list[tuple[dict[str, float], complex, str]] = []  # sign of a link's point, right side, point
    for point in linkage.points:
        holders = [n for n in names if point in linkage.links[n]]
        if point in linkage.fixed:
            rows += [({h: 1.0}, linkage.fixed[point], point) for h in holders]
        else:
            rows += [({holders[0]: 1.0, h: -1.0}, 0j, point) for h in holders[1:]]
    count = len(rows) + len(slides)
    origin, turns = np.zeros((count, len(names))), np.zeros((count, len(names) + len(slides)), dtype=complex)
    right = np.zeros(count, dtype=complex)
    for k, (signs, b, point) in enumerate(rows):
        right[k] = b
        for n, sign in signs.items():
            origin[k, names.index(n)] = sign
            turns[k, names.index(n)] = sign * linkage.links[n][point]
    for k, slide in enumerate(linkage.slides.values()):  # the point of its holder less that of its guide
        row, holder = len(rows) + k, linkage.holder(slide)
        turns[row, len(names) + k] = -size * slide.along / abs(slide.along)
        for name, sign, at in ((holder, 1.0, linkage.fixed.get(slide.point, 0j)), (slide.guide, -1.0, slide.through)):
            if name == GROUND:
                right[row] -= sign * at
            elif name is not None:
                origin[row, names.index(name)] = sign
                turns[row, names.index(name)] += sign * (at if sign < 0.0 else linkage.links[name][slide.point])
    if np.linalg.matrix_rank(origin) < len(names):
        raise MechlabError("linkage: some links are not connected with the ground; every link needs a way to a fixed point.")
    left, _, _ = np.linalg.svd(origin)
    null = left[:, len(names) :]
    reduced, reduced_right = null.T @ turns, null.T @ right
    free = [*(names.index(n) for n in linkage.unknowns), *(len(names) + k for k in range(len(slides)))]
    known = [names.index(n) for n in linkage.drives]
    count, loop_count = len(free), reduced.shape[0]
    if count != 2 * loop_count:
        surplus = count - 2 * loop_count
        what = f"{surplus} more drives are needed" if surplus > 0 else f"{-surplus} constraints too many, counting two for each loop"
        what = f"{count} unknown turns{' and places' if slides else ''} in {loop_count} loops of two equations each: {what}"
        alone = [p for p in linkage.points if linkage.shared(p) < 2]
        raise MechlabError(f"linkage: {what}{'; nothing is pinned to ' + ', '.join(alone) if surplus > 0 and alone else ''}.")
    if loop_count > LARGEST_LOOPS:
        many = path_count(loop_count)
        raise MechlabError(f"linkage: {loop_count} loops have up to {many} modes; at most {LARGEST_LOOPS} loops are solved.")
    if np.linalg.matrix_rank(reduced[:, free], tol=1e-12 * linkage.size) < loop_count:
        raise MechlabError("linkage: a loop without an unknown turn; two drives, or a drive and the ground, contradict each other.")
    back = np.linalg.pinv(origin).astype(complex)
    guides = tuple(_guide(linkage, s.guide) for s in linkage.slides.values())
    turning = len(linkage.unknowns)
    return Loops(reduced[:, free], reduced[:, known], reduced_right, back @ turns, back @ right, turning, guides, size)


def _guide(linkage: Links, name: str) -> int:
    if name == GROUND:
        return FIXED_GUIDE
    return -2 - linkage.drives.index(name) if name in linkage.drives else linkage.unknowns.index(name)
