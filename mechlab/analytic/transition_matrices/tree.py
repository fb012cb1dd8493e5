"""A tree of links, its transition matrices and their derivatives by world operators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.transition_matrices.generators import FloatArray, _finite, joint_motion
from mechlab.errors import MechlabError


@dataclass(frozen=True)
class Link:
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
    """Links, each after its parent, and gravity (2,) or (3,) [m/s2]. `ancestors[i]`: link i and those it hangs on, the
    root first. Raises MechlabError for a parent that comes later, or matrices of different sizes.
    """

    links: tuple[Link, ...]
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

    def coordinates(self, values: ArrayLike, what: str) -> FloatArray:
        """(..., links) finite floats; raises MechlabError that says the number of links."""
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
        kept: list[Link] = []
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


def _with(link: Link, **changes: object) -> Link:
    from dataclasses import replace

    return replace(link, **changes)  # type: ignore[arg-type]


def transitions(tree: Tree, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """G (..., links, d, d), link to world, and the world operators W (..., links, d, d) of the joints.

    G_i = G_parent B_i exp(q_i Om_i);  W_i = (G_parent B_i) Om_i (G_parent B_i)^-1. With them dG_i/dq_j = W_j G_i for
    every j that link i hangs on.
    """
    x = tree.coordinates(q, "q")
    shape = (*x.shape[:-1], len(tree.links), tree.size, tree.size)
    world, operators = np.empty(shape), np.empty(shape)
    for i, link in enumerate(tree.links):
        base = world[..., link.parent, :, :] @ link.placement if link.parent >= 0 else link.placement
        world[..., i, :, :] = base @ joint_motion(link.generator, x[..., i])
        operators[..., i, :, :] = base @ link.generator @ _inverse(base)
    return world, operators


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
