"""Trees of links in homogeneous matrices: generators of joints, placements, pseudo-inertias, motions of joints; transition
matrices and their derivatives by world operators.

Planar matrices are 3 x 3, spatial ones 4 x 4; the number of entries of an axis or point says which.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

FloatArray = NDArray[np.float64]


def revolute(axis: ArrayLike | None = None) -> FloatArray:
    """Generator of a turn: planar (3, 3) counter-clockwise without an axis, spatial (4, 4) about a unit axis (3,)."""
    out = np.zeros((3, 3)) if axis is None else np.zeros((4, 4))
    if axis is None:
        out[0, 1], out[1, 0] = -1.0, 1.0
        return out
    x, y, z = _unit(axis, (3,))
    out[:3, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    return out


def prismatic(axis: ArrayLike) -> FloatArray:
    """Generator of a slide along a unit axis: (2,) gives the planar (3, 3), (3,) the spatial (4, 4); its square is 0."""
    a = _unit(axis, (2,), (3,))
    out = np.zeros((len(a) + 1, len(a) + 1))
    out[:-1, -1] = a
    return out


def placement(position: ArrayLike, rotation: ArrayLike | float = 0.0) -> FloatArray:
    """Constant place of a joint in its parent: planar from (x, y) and an angle, spatial from (x, y, z) and (3, 3)."""
    p = _finite("position", position)
    if p.shape not in ((2,), (3,)):
        raise MechlabError(f"position has shape {p.shape}; expected (2,) in the plane or (3,) in space")
    out = np.eye(len(p) + 1)
    out[:-1, -1] = p
    r = _finite("rotation", rotation)
    if len(p) == 2:
        if r.shape != ():
            raise MechlabError(f"rotation has shape {r.shape}; a planar placement takes an angle [rad]")
        c, s = np.cos(r), np.sin(r)
        out[:2, :2] = [[c, -s], [s, c]]
    elif r.shape == (3, 3):
        if not np.allclose(r @ r.T, np.eye(3), rtol=0.0, atol=1e-9) or np.linalg.det(r) < 0.0:
            raise MechlabError("rotation is no rotation matrix: its rows are not orthonormal and right-handed")
        out[:3, :3] = r
    elif r.shape != () or r != 0.0:
        raise MechlabError(f"rotation has shape {r.shape}; a spatial placement takes a matrix (3, 3)")
    return out


def planar_inertia(mass: float, com: ArrayLike, inertia: float) -> FloatArray:
    """(3, 3) pseudo-inertia H = integral of r r^T dm, r = (x, y, 1), from the mass [kg], the centre of mass (2,) [m]
    and the moment of inertia [kg m2] about it.

    H11 and H22 share the central moment in halves: in the plane only their sum matters.
    """
    _masses(mass, inertia)
    half = 0.5 * inertia * np.eye(2)
    return _pseudo(mass, com, half, (2,))


def spatial_inertia(mass: float, com: ArrayLike, tensor: ArrayLike) -> FloatArray:
    """(4, 4) pseudo-inertia H = integral of r r^T dm, r = (x, y, z, 1), from the mass [kg], the centre of mass (3,) [m]
    and the inertia tensor (3, 3) [kg m2] about it: its upper block is tr(I)/2 E - I + m c c^T."""
    i = _finite("tensor", tensor)
    if i.shape != (3, 3) or not np.allclose(i, i.T):
        raise MechlabError(f"tensor: expected a symmetric matrix (3, 3), got shape {i.shape}")
    _masses(mass, *np.diag(i))
    return _pseudo(mass, com, 0.5 * np.trace(i) * np.eye(3) - i, (3,))


def joint_motion(generator: FloatArray, q: ArrayLike) -> FloatArray:
    """exp(q Om) (..., d, d) of coordinates q (...): E + sin q Om + (1 - cos q) Om^2 for a turn, E + q Om for a slide.

    In the plane the first is [[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]].
    """
    angle = _finite("q", q)[..., None, None]
    unit = np.eye(len(generator))
    if not np.any(generator[:-1, :-1]):
        return np.asarray(unit + angle * generator)
    return np.asarray(unit + np.sin(angle) * generator + (1.0 - np.cos(angle)) * (generator @ generator))


def _pseudo(mass: float, com: ArrayLike, central: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    c = _finite("com", com)
    if c.shape != shape:
        raise MechlabError(f"com has shape {c.shape}; expected {shape}")
    r = np.append(c, 1.0)
    out = mass * np.outer(r, r)
    out[:-1, :-1] += central
    return out


def _masses(mass: float, *moments: float) -> None:
    if not np.isfinite(mass) or mass < 0.0 or any(not np.isfinite(x) or x < 0.0 for x in moments):
        raise MechlabError(f"mass {mass!r}, moments of inertia {moments!r}: expected finite numbers, zero or more")


def _unit(axis: ArrayLike, *shapes: tuple[int, ...]) -> FloatArray:
    a = _finite("axis", axis)
    size = float(np.linalg.norm(a))
    if a.shape not in shapes or size == 0.0:
        raise MechlabError(f"axis {a.tolist()}: expected a vector of shape {' or '.join(map(str, shapes))}, not zero")
    return np.asarray(a / size)


def _finite(name: str, value: ArrayLike) -> FloatArray:
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)):
        raise MechlabError(f"{name} has values that are not finite")
    return array


@dataclass(frozen=True)
class TreeLink:
    """One link: index of its parent (-1: the ground), constant `placement` B of its joint there, `generator` Om of the
    joint, pseudo-inertia H; all (3, 3), or all (4, 4).

    Its elastic element pulls with stiffness (q - rest) + damping dq/dt [N, or N m for a turn].
    """

    parent: int
    placement: FloatArray
    generator: FloatArray
    inertia: FloatArray
    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class Tree:
    """Links, each after its parent, and gravity (2,) or (3,) [m/s2]. `ancestors[i]`: the links from
    the root to link i, both included. Raises MechlabError for a parent that comes later, or matrices of different
    sizes.
    """

    links: tuple[TreeLink, ...]
    gravity: tuple[float, ...]
    ancestors: tuple[tuple[int, ...], ...] = field(init=False)

    def __post_init__(self) -> None:
        size = len(self.gravity) + 1
        paths: list[tuple[int, ...]] = []
        for i, link in enumerate(self.links):
            if not -1 <= link.parent < i:
                raise MechlabError(f"link {i}: its parent is {link.parent}; expected -1 (ground) or a link before it")
            for name in ("placement", "generator", "inertia"):
                if np.shape(getattr(link, name)) != (size, size):
                    raise MechlabError(
                        f"link {i}: {name} has shape {np.shape(getattr(link, name))}; expected {(size, size)}, as "
                        f"gravity has {size - 1} entries"
                    )
            paths.append((*(paths[link.parent] if link.parent >= 0 else ()), i))
        object.__setattr__(self, "ancestors", tuple(paths))

    @property
    def size(self) -> int:
        """3 in the plane, 4 in space."""
        return len(self.gravity) + 1

    @cached_property
    def inertias(self) -> FloatArray:
        """(links, d, d) pseudo-inertias H."""
        return np.array([x.inertia for x in self.links])

    @cached_property
    def elastic(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(links,) stiffness, rest and damping."""
        c, q0, b = np.array([(x.stiffness, x.rest, x.damping) for x in self.links]).T
        return c, q0, b

    @cached_property
    def generators(self) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """(links, d, d) generators Om and their squares, and (links,) which joints turn."""
        om = np.array([x.generator for x in self.links])
        return om, om @ om, np.any(om[:, :-1, :-1], axis=(1, 2))

    @cached_property
    def on_path(self) -> NDArray[np.bool_]:
        """(links, links) whether link j lies on the path from the root to link k, k included."""
        n = len(self.links)
        return np.array([[j in self.ancestors[k] for k in range(n)] for j in range(n)]).reshape(n, n)

    @cached_property
    def above(self) -> NDArray[np.bool_]:
        """`on_path` without the diagonal."""
        return np.asarray(self.on_path & ~np.eye(len(self.links), dtype=bool))

    def coordinates(self, values: ArrayLike, what: str) -> FloatArray:
        """`values` as finite floats (..., links). Raises MechlabError for another shape."""
        array = _finite(what, values)
        if array.ndim == 0 or array.shape[-1] != len(self.links):
            raise MechlabError(f"{what} has shape {array.shape}; expected (..., {len(self.links)}), one for each link")
        return array

    def merged(self, locked: Sequence[int]) -> Tree:
        """The same tree with the joints of these links held at zero: each locked link becomes part of its parent.

        A link locked to the ground leaves the tree: its weight moves nothing.
        """
        links = list(self.links)
        home: dict[int, tuple[int, FloatArray]] = {-1: (-1, np.eye(self.size))}
        kept: list[TreeLink] = []
        for i, link in enumerate(links):
            parent, where = home[link.parent]
            place = where @ link.placement
            if i in locked:
                home[i] = (parent, place)
                if parent >= 0:
                    host = kept[parent]
                    kept[parent] = _with(host, inertia=host.inertia + place @ link.inertia @ place.T)
                continue
            kept.append(_with(link, parent=parent, placement=place))
            home[i] = (len(kept) - 1, np.eye(self.size))
        return Tree(tuple(kept), self.gravity)


def _with(link: TreeLink, **changes: object) -> TreeLink:
    from dataclasses import replace

    return replace(link, **changes)  # type: ignore[arg-type]


def transitions(tree: Tree, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """G (..., links, d, d), link to world, and the world operators W (..., links, d, d) of the joints.

    G_i = G_parent B_i exp(q_i Om_i);  W_i = (G_parent B_i) Om_i (G_parent B_i)^-1. With them dG_i/dq_j = W_j G_i for
    every j that link i hangs on.
    """
    x = tree.coordinates(q, "q")
    shape = (*x.shape[:-1], len(tree.links), tree.size, tree.size)
    world, bases = np.empty(shape), np.empty(shape)
    om, square, turns = tree.generators
    angle = x[..., None, None]
    turned = np.sin(angle) * om + (1.0 - np.cos(angle)) * square
    motion = np.where(turns[:, None, None], turned, angle * om) + np.eye(tree.size)
    for i, link in enumerate(tree.links):
        base = world[..., link.parent, :, :] @ link.placement if link.parent >= 0 else link.placement
        bases[..., i, :, :] = base
        world[..., i, :, :] = base @ motion[..., i, :, :]
    return world, np.asarray(bases @ om @ _inverse(bases))


def first_derivative(tree: Tree, q: ArrayLike, i: int, j: int) -> FloatArray:
    """U_ij = dG_i/dq_j (..., d, d): W_j G_i, zero when link i does not hang on joint j."""
    world, operators = transitions(tree, q)
    if j not in tree.ancestors[i]:
        return np.zeros(world[..., i, :, :].shape)
    return np.asarray(operators[..., j, :, :] @ world[..., i, :, :])


def second_derivative(tree: Tree, q: ArrayLike, i: int, j: int, k: int) -> FloatArray:
    """U_ijk = d2G_i/dq_j dq_k (..., d, d): W_j W_k G_i with j the one nearer to the root; U_ijk = U_ikj."""
    world, operators = transitions(tree, q)
    if j not in tree.ancestors[i] or k not in tree.ancestors[i]:
        return np.zeros(world[..., i, :, :].shape)
    near, far = sorted((j, k), key=tree.ancestors[i].index)
    return np.asarray(operators[..., near, :, :] @ operators[..., far, :, :] @ world[..., i, :, :])


def _inverse(g: FloatArray) -> FloatArray:
    """Inverse of a homogeneous matrix (..., d, d): [R^T, -R^T p]."""
    out = np.zeros_like(g)
    turned = np.swapaxes(g[..., :-1, :-1], -1, -2)
    out[..., :-1, :-1] = turned
    out[..., :-1, -1] = -(turned @ g[..., :-1, -1:])[..., 0]
    out[..., -1, -1] = 1.0
    return out
