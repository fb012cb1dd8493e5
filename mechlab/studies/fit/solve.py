"""Weighted least squares over runs: residuals, their Jacobian, noise by channel, and the covariance at the end.

Minimized is sum ((measured - predicted) / sigma)^2 with sigma stated, or estimated by channel from the residual in turn with the
parameters. J: derivatives of the predictions by unknowns in units of their scale, over sigma. With J = U diag(s) V' the covariance of
the unknowns is chi^2 / (n - p) V diag(1/s^2) V'. Source: Seber & Wild 2003, chapters 2 and 3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field

import numpy as np
from scipy.optimize import least_squares

from mechlab.errors import MechlabError
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.fit.predictions import Predictions
from mechlab.studies.fit.unknowns import FitUnknown, applied

STEP, ON_THE_WAY = 1e-4, 1e-5
"""Difference steps relative to the scale of an unknown, central at the end and one-sided before: their error is the square of the first,
and the second."""
ROUNDS = 6
"""Most rounds of estimating the noise of several channels."""
SETTLED = 0.05
"""Relative change of the estimated noise below which no more rounds follow."""
LEAST_NOISE = 1e-9
"""Smallest estimated noise, relative to the largest value of the channel: rounding of the engines."""
GUESS = 0.01
"""First noise of a channel, relative to its standard deviation."""
FAR = 1e3
"""Weighted residual of a design that has no motion, relative to that of the start."""
ENOUGH, SMALLEST = 1e-6, 1e-8
"""Relative changes of chi^2 and of the unknowns that end a search: the first is about 1e-2 of a standard error."""
RANK = 1e-6
"""A singular value below this share of the largest is zero: central differences are exact to about 1e-8."""
MOST_STEPS = 40
"""Most steps of a round."""


@dataclass
class FitProblem:
    """Measured channels and their predictions as functions of the unknowns. way: the engine or witness that predicts."""

    base: Design
    unknowns: tuple[FitUnknown, ...]
    predictions: Predictions
    measured: Mapping[str, Array]
    stated: Mapping[str, float]
    way: str
    report: Callable[[int], None] = lambda done: None
    runs: int = 0
    _known: dict[tuple[str, bytes], dict[str, Array] | None] = field(default_factory=dict)

    @property
    def rows(self) -> dict[str, Array]:
        """Channel -> (n,) where it is measured."""
        return {n: np.isfinite(x) for n, x in self.measured.items()}

    @property
    def count(self) -> int:
        """Number of measured values."""
        return int(sum(m.sum() for m in self.rows.values()))

    @property
    def scales(self) -> Array:
        """(p,) scales of the unknowns."""
        return np.array([u.scale for u in self.unknowns])

    def series(self, x: Array, way: str = "") -> dict[str, Array]:
        """Channel -> (n,) predicted at the unknowns x (p,). Raises MechlabError where there is no motion."""
        design, extra = applied(self.base, self.unknowns, x)
        self.runs += 1
        self.report(self.runs)
        return self.predictions.at(way or self.way, design, extra)

    def residuals(self, x: Array, way: str = "") -> dict[str, Array]:
        """Channel -> measured less predicted (m,) where measured; angles of a question modulo 2 pi. Kept for the last designs."""
        key = (way or self.way, np.asarray(x, dtype=float).tobytes())
        if key not in self._known:
            if len(self._known) > 64:
                self._known.pop(next(iter(self._known)))
            self._known[key] = self._difference(self.series(x, way))
        found = self._known[key]
        assert found is not None
        return found

    def _difference(self, series: Mapping[str, Array]) -> dict[str, Array]:
        out = {}
        for name, values in self.measured.items():
            gap = (values - series[name])[self.rows[name]]
            out[name] = (gap + np.pi) % (2.0 * np.pi) - np.pi if name in self.predictions.angles else gap
        return out

    def weighted(self, x: Array, noise: Mapping[str, float], way: str = "") -> Array:
        """(n,) all residuals over the noise of their channels."""
        found = self.residuals(x, way)
        return np.concatenate([found[n] / noise[n] for n in self.measured])

    def jacobian(self, x: Array, noise: Mapping[str, float], central: bool) -> Array:
        """(n, p) derivatives of the predictions over their noise by the unknowns over their scales; one-sided next to a bound
        and where one side has no motion. Raises MechlabError where neither side has one."""
        here, step = self.weighted(x, noise), STEP if central else ON_THE_WAY
        out = np.empty((len(here), len(x)))
        for k, item in enumerate(self.unknowns):
            found: list[tuple[float, Array]] = []
            cause: MechlabError | None = None
            for side in (1.0, -1.0):
                moved = x.copy()
                moved[k] += side * step * item.scale
                if not item.low <= moved[k] <= item.high:
                    continue
                try:
                    found.append((side * step, self.weighted(moved, noise)))
                except MechlabError as error:
                    cause = error
                if found and not central:
                    break
            if not found:
                raise cause or MechlabError(f"{self.base.name}: {item.name}: its range is narrower than a difference step.")
            if len(found) == 2:
                out[:, k] = -(found[0][1] - found[1][1]) / (2.0 * step)
            else:
                out[:, k] = -(found[0][1] - here) / found[0][0]
        return out


@dataclass(frozen=True)
class LeastSquares:
    """The end of a fit: unknowns x (p,), noise by channel, J (n, p) as of `FitProblem.jacobian`, residuals by channel, whether the
    search ended at a minimum, and how many steps it took."""

    x: Array
    noise: dict[str, float]
    jacobian: Array
    residuals: dict[str, Array]
    ended: bool
    steps: int

    @property
    def weighted(self) -> Array:
        """(n,) residuals over their noise."""
        return np.concatenate([r / self.noise[n] for n, r in self.residuals.items()])

    @property
    def degrees(self) -> int:
        """Measured values less unknowns."""
        return len(self.jacobian) - self.jacobian.shape[1]

    @property
    def factor(self) -> float:
        """chi^2 over the degrees of freedom: the variance of the residuals in units of the noise."""
        return float(np.sum(self.weighted**2)) / self.degrees


def minimise(problem: FitProblem, start: Array, noise: Mapping[str, float] | None = None) -> LeastSquares:
    """The least squares from a start. noise: first guess for channels without a stated one.

    Raises MechlabError where there are fewer values than unknowns, and where the start has no motion.
    """
    if problem.count <= len(problem.unknowns):
        raise MechlabError(
            f"{problem.base.name}: {problem.count} measured values cannot determine {len(problem.unknowns)} unknowns and their errors; "
            f"expected more than {len(problem.unknowns)}."
        )
    guessed = first_noise(problem) | dict(noise or {}) | dict(problem.stated)
    x, steps, ended = start, 0, False
    pull = _undetermined(problem, start, guessed)
    for done in range(ROUNDS):
        x, more, ended = _search(problem, x, guessed, pull)
        steps += more
        found = _estimated(problem, x) | dict(problem.stated)
        settled = all(abs(found[n] - guessed[n]) <= SETTLED * guessed[n] for n in found)
        guessed = found
        if done and (settled or len(problem.stated) == len(found) or len(found) == 1):
            break
    jacobian = problem.jacobian(x, guessed, central=True)
    x = _polished(problem, x, guessed, jacobian)
    return LeastSquares(x, guessed, jacobian, problem.residuals(x), ended, steps)


def first_noise(problem: FitProblem) -> dict[str, float]:
    """The stated noise of channels, else a small share of how much they vary."""
    spread = {n: float(np.nanstd(x)) or float(np.nanmax(np.abs(x))) or 1.0 for n, x in problem.measured.items()}
    return {n: GUESS * s for n, s in spread.items()} | dict(problem.stated)


def search(problem: FitProblem, start: Array, noise: Mapping[str, float]) -> tuple[Array, int, bool]:
    """Unknowns (p,) at the least squares next to a start for a given noise, steps, whether it ended by its tolerances."""
    return _search(problem, start, noise, _undetermined(problem, start, noise))


def _undetermined(problem: FitProblem, x: Array, noise: Mapping[str, float]) -> Array:
    """(k, p) directions along which the data determine nothing, times the largest singular value: rows that hold the search there, where
    it would follow the error of the differences. They change no residual."""
    _, s, v = np.linalg.svd(problem.jacobian(x, noise, central=True), full_matrices=False)
    return np.asarray(s[0] * v[s <= RANK * s[0]])


def _polished(problem: FitProblem, x: Array, noise: Mapping[str, float], jacobian: Array) -> Array:
    """One Gauss-Newton step with central differences, where it is no step back."""
    here = problem.weighted(x, noise)
    step = np.linalg.pinv(jacobian, rcond=RANK) @ here * problem.scales
    low, high = ([getattr(u, end) for u in problem.unknowns] for end in ("low", "high"))
    moved = np.clip(x + step, low, high)
    try:
        better = bool(np.sum(problem.weighted(moved, noise) ** 2) <= np.sum(here**2))
    except MechlabError:
        better = False
    return moved if better else x


def _estimated(problem: FitProblem, x: Array) -> dict[str, float]:
    """Noise by channel from its residual, with its share of the unknowns taken off its number of values."""
    out, share = {}, len(problem.unknowns) / problem.count
    for name, r in problem.residuals(x).items():
        floor = LEAST_NOISE * float(np.nanmax(np.abs(problem.measured[name])) or 1.0)
        out[name] = max(floor, float(np.sqrt(np.mean(r**2) / (1.0 - share))))
    return out


def _search(problem: FitProblem, start: Array, noise: Mapping[str, float], pull: Array) -> tuple[Array, int, bool]:
    """Unknowns at the least squares for a given noise, steps, whether it ended by its tolerances. pull: rows as of `_undetermined`."""
    scales = problem.scales
    first = problem.weighted(start, noise)  # raises where the start has no motion
    far = FAR * max(1.0, float(np.max(np.abs(first))))
    low = np.array([u.low for u in problem.unknowns]) / scales
    high = np.array([u.high for u in problem.unknowns]) / scales
    begin = np.clip(start / scales, low, high)

    def residuals(z: Array) -> Array:
        try:
            return np.concatenate([problem.weighted(z * scales, noise), pull @ (z - begin)])
        except MechlabError:
            return np.full(len(first) + len(pull), far)

    def jacobian(z: Array) -> Array:
        return np.vstack([-problem.jacobian(z * scales, noise, central=False), pull])

    done = least_squares(
        residuals, begin, jacobian, (low, high), xtol=SMALLEST, ftol=ENOUGH, gtol=SMALLEST, max_nfev=MOST_STEPS
    )
    return done.x * scales, int(done.nfev), bool(done.status > 0)
