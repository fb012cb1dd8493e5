"""Mass matrix, velocity terms and generalized forces of a tree, vectorized over states: q, v (..., links).

With the world pseudo-inertia N_i = G_i H_i G_i^T and its sum C_j over all links that hang on joint j:

    M_jk = tr(W_j C_k W_k^T)            j on the path from the root to k (or k itself)
    h_j  = sum over i of tr(W_j N_i S_i^T),  d2G_i/dt2 = S_i G_i at zero joint accelerations,
           S_i = sum of (2 R W_k v_k + W_k^2 v_k^2) along the path to i, R the sum of the W v before k
    Q_j  = g . (W_j C_j e) - stiffness (q_j - rest_j) - damping v_j + f_j,   e = (0, .., 0, 1)

M qdd + h = Q (Vukobratovic, Legged locomotion robots, 1976; Korenev 1977). The elastic line of Q is equation (40) of the
leg article with a rest length.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.transition_matrices.tree import FloatArray, Tree, transitions
from mechlab.errors import MechlabError


def mass_matrix(tree: Tree, q: ArrayLike) -> FloatArray:
    """M (..., links, links) [kg m2, kg m, kg]."""
    world, w = transitions(tree, q)
    return _mass(tree, w, _below(tree, _world_inertias(tree, world)))


def bias_force(tree: Tree, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """h (..., links): centrifugal and Coriolis terms; no gravity, no springs."""
    world, w = transitions(tree, q)
    return _bias(tree, w, _world_inertias(tree, world), _rates(tree, q, v))


def gravity_force(tree: Tree, q: ArrayLike) -> FloatArray:
    """(..., links) generalized force of the weight: sum of m_i g . dr_i/dq_j."""
    world, w = transitions(tree, q)
    return _gravity(tree, w, _below(tree, _world_inertias(tree, world)))


def elastic_force(tree: Tree, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """(..., links) force of springs and dampers: -stiffness (q - rest) - damping v."""
    c, q0, b = tree.elastic
    return np.asarray(-c * (tree.coordinates(q, "q") - q0) - b * tree.coordinates(v, "v"))


def accelerations(tree: Tree, q: ArrayLike, v: ArrayLike, force: ArrayLike = 0.0) -> FloatArray:
    """(..., links) qdd of M qdd + h = gravity + springs + `force`, which broadcasts against q.

    Raises MechlabError for a joint that moves no mass.
    """
    world, w = transitions(tree, q)
    inertias = _world_inertias(tree, world)
    below = _below(tree, inertias)
    right = _gravity(tree, w, below) + elastic_force(tree, q, v) - _bias(tree, w, inertias, _rates(tree, q, v))
    right = right + np.asarray(force, dtype=float)
    try:
        return np.asarray(np.linalg.solve(_mass(tree, w, below), right[..., None])[..., 0])
    except np.linalg.LinAlgError:
        raise MechlabError("the mass matrix is singular: a joint moves no mass. Give the links beyond it one") from None


def energy(tree: Tree, q: ArrayLike, v: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Kinetic and potential energy (...) [J]; the potential of weight and springs, zero for weights at the origin."""
    world, w = transitions(tree, q)
    inertias, rates = _world_inertias(tree, world), _rates(tree, q, v)
    kinetic, potential = np.zeros(rates.shape[:-1]), np.zeros(rates.shape[:-1])
    g = np.array(tree.gravity)
    for i, path in enumerate(tree.ancestors):
        spin = np.einsum("...j,...jab->...ab", rates[..., list(path)], w[..., list(path), :, :])
        kinetic += 0.5 * np.einsum("...ab,...bc,...ac->...", spin, inertias[..., i, :, :], spin)
        potential -= inertias[..., i, :-1, -1] @ g
    for i, link in enumerate(tree.links):
        potential += 0.5 * link.stiffness * (tree.coordinates(q, "q")[..., i] - link.rest) ** 2
    return kinetic, potential


def _rates(tree: Tree, q: ArrayLike, v: ArrayLike) -> FloatArray:
    return np.broadcast_arrays(tree.coordinates(v, "v"), tree.coordinates(q, "q"))[0]


def _world_inertias(tree: Tree, world: FloatArray) -> FloatArray:
    """N_i = G_i H_i G_i^T (..., links, d, d)."""
    return np.asarray(world @ tree.inertias @ np.swapaxes(world, -1, -2))


def _below(tree: Tree, inertias: FloatArray) -> FloatArray:
    """C_j: the sum of N over link j and all that hangs on it."""
    out = inertias.copy()
    for i in reversed(range(len(tree.links))):
        if tree.links[i].parent >= 0:
            out[..., tree.links[i].parent, :, :] += out[..., i, :, :]
    return out


def _mass(tree: Tree, w: FloatArray, below: FloatArray) -> FloatArray:
    """M from W (..., links, d, d) and C: all pairs at once, of which those on one path count."""
    right = below @ np.swapaxes(w, -1, -2)
    pairs = _flat(w) @ np.swapaxes(_flat(np.swapaxes(right, -1, -2)), -1, -2)
    upper = np.where(tree.on_path, pairs, 0.0)
    return np.asarray(upper + np.swapaxes(np.where(tree.above, upper, 0.0), -1, -2))


def _bias(tree: Tree, w: FloatArray, inertias: FloatArray, v: FloatArray) -> FloatArray:
    """h from W and N (..., links, d, d) and the rates v (..., links): from the root outwards, then loads summed back."""
    now = w * v[..., None, None]
    twice, rate, second = 2.0 * now, now.copy(), now @ now
    for i, link in enumerate(tree.links):
        if link.parent >= 0:
            before = rate[..., link.parent, :, :]
            second[..., i, :, :] += second[..., link.parent, :, :] + before @ twice[..., i, :, :]
            rate[..., i, :, :] += before
    loads = _below(tree, inertias @ np.swapaxes(second, -1, -2))
    return np.asarray((w * np.swapaxes(loads, -1, -2)).sum(axis=(-2, -1)))


def _flat(matrices: FloatArray) -> FloatArray:
    """Matrices (..., n, d, d) as rows (..., n, d d)."""
    return matrices.reshape(*matrices.shape[:-2], -1)


def _gravity(tree: Tree, w: FloatArray, below: FloatArray) -> FloatArray:
    moved = (w @ below[..., :, -1:])[..., :-1, 0]
    return np.asarray(moved @ np.array(tree.gravity))
