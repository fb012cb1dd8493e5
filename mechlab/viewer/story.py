"""A Story: the data of a page, a picture or a film. Solids, poses over time, plots and sentences; no engine.

Its arrays are checked (shape, finite, rigid where they must be) and read-only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.viewer.channels import Channels

if TYPE_CHECKING:
    from mechlab.viewer.explore import Exploration
    from mechlab.viewer.knots import Knots
    from mechlab.viewer.named_numbers import NamedNumbers

Array = NDArray[np.float64]

RIGID_TOLERANCE = 1e-6


def frozen(values: ArrayLike, what: str, shape: tuple[int | None, ...], finite: bool = True) -> Array:
    """`values` as a read-only float64 array of `shape` (None: any length); raises MechlabError that names
    `what`."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise MechlabError(f"{what}: expected numbers of shape {shape}, got {type(values).__name__}.") from None
    matches = array.ndim == len(shape) and all(
        want in (None, got) for want, got in zip(shape, array.shape, strict=True)
    )
    if not matches:
        expected = str(tuple("any" if n is None else n for n in shape)).replace("'", "")
        raise MechlabError(f"{what}: expected shape {expected}, got {array.shape}.")
    if finite and not np.all(np.isfinite(array)):
        first = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise MechlabError(f"{what}: every number must be finite, but {what}{list(first)} is {array[first]}.")
    array.flags.writeable = False
    return array


def check_rigid(matrices: Array, what: str) -> None:
    """Raises MechlabError unless every (4, 4) matrix is a rotation and a translation."""
    rotation = matrices[..., :3, :3]
    error = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max(axis=(-1, -2))
    error = np.maximum(error, np.abs(np.linalg.det(rotation) - 1.0))
    error = np.maximum(error, np.abs(matrices[..., 3, :] - [0.0, 0.0, 0.0, 1.0]).max(axis=-1))
    if error.size and error.max() > RIGID_TOLERANCE:
        where = [int(i) for i in np.unravel_index(int(error.argmax()), error.shape)]
        raise MechlabError(
            f"{what}{where}: not a rigid placement (error {error.max():.1e}, limit {RIGID_TOLERANCE:.0e}); "
            "expected [[R, p], [0, 0, 0, 1]] with a proper rotation R."
        )


Color = tuple[float, float, float, float]
Severity = Literal["ok", "warning", "error"]

GREY: Color = (0.62, 0.66, 0.72, 1.0)
TRACES: tuple[Color, ...] = (
    (0.76, 0.09, 0.36, 1.0), (0.0, 0.47, 0.42, 1.0), (0.37, 0.21, 0.69, 1.0), (0.70, 0.33, 0.0, 1.0), (0.08, 0.40, 0.75, 1.0),
)  # fmt: skip
"""Colours of the paths that points draw, in turn, in pictures, films and GLB files; the page has the same."""


@dataclass(frozen=True, eq=False)
class Part:
    """One drawn solid, rigid in one body.

    vertices: (n, 3) [m]; faces: (m, 3) vertex indices, counter-clockwise seen from outside; color: red,
    green, blue, opacity in 0..1; placement: (4, 4), part to body. Parts with equal vertices and faces share
    their geometry in every output. Raises MechlabError for wrong shapes, indices out of range, colours
    outside 0..1, a placement that is not rigid.
    """

    body: str
    name: str
    vertices: Array
    faces: NDArray[np.int64]
    color: Color = GREY
    placement: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        what = f"part {self.name!r} of body {self.body!r}"
        vertices = frozen(self.vertices, f"{what}: vertices", (None, 3))
        faces = np.array(self.faces, dtype=np.int64)
        if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            raise MechlabError(f"{what}: faces: expected shape (any, 3) with at least one face, got {faces.shape}.")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise MechlabError(
                f"{what}: faces: indices must lie in 0..{len(vertices) - 1}, got {faces.min()}..{faces.max()}."
            )
        faces.flags.writeable = False
        color = frozen(self.color, f"{what}: color", (4,))
        if color.min() < 0.0 or color.max() > 1.0:
            raise MechlabError(
                f"{what}: color: red, green, blue, opacity must lie in 0..1, got {tuple(color.tolist())}."
            )
        placement = frozen(self.placement, f"{what}: placement", (4, 4))
        check_rigid(placement, f"{what}: placement")
        for name, value in (
            ("vertices", vertices),
            ("faces", faces),
            ("placement", placement),
            ("color", tuple(color.tolist())),
        ):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class Floor:
    """A floor that stands still: placement (4, 4) of its middle, z its normal; x, y: its sides [m], 0 for one without end."""

    placement: Array
    x: float = 0.0
    y: float = 0.0
    color: Color = GREY

    def __post_init__(self) -> None:
        placement = frozen(self.placement, "floor: placement", (4, 4))
        check_rigid(placement, "floor: placement")
        object.__setattr__(self, "placement", placement)

    @property
    def level(self) -> float | None:
        """Its height [m] where it is level, else None."""
        return float(self.placement[2, 3]) if self.placement[2, 2] > 1.0 - 1e-9 else None


@dataclass(frozen=True, eq=False)
class Plot:
    """Curves over the story's time that share one axis: series name -> (n,) values in `unit` ("" has none).

    A value that is not finite is drawn as a gap. against: series with the same names of the compared run.
    """

    title: str
    unit: str
    series: Mapping[str, Array]
    against: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Arrow:
    """A force or a torque over the story's time: kind "force" or "torque"; points: (n, 3) where it acts [m];
    vectors: (n, 3) in `unit`, world axes; on: the body it acts on, by: the one that feels the opposite ("": not known)."""

    name: str
    kind: Literal["force", "torque"]
    unit: str
    points: Array
    vectors: Array
    on: str = ""
    by: str = ""


@dataclass(frozen=True)
class Mark:
    """A named point or axis fixed in a body: `point` (3,) in the body [m]; with a `direction` (3,) it is a joint axis,
    without one a label."""

    body: str
    name: str
    point: tuple[float, float, float]
    direction: tuple[float, float, float] | None = None
    kind: str = ""


@dataclass(frozen=True, eq=False)
class ColorField:
    """A quantity over the surface of a part: values (n,) in `unit` at the vertices of the part of that name; text: its meaning."""

    part: str
    name: str
    unit: str
    text: str
    values: Array


@dataclass(frozen=True)
class Clip:
    """A part of a story that is played by itself: from `start` to `end` [s], with a name, what a button shows beside it, and a
    sentence."""

    name: str
    value: str
    text: str
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class Variation:
    """A parameter `key` in `unit` that the page can change: `values` and, for each, the Story of that design, or a
    sentence why there is none. home: index of the value of the story itself."""

    key: str
    unit: str
    values: tuple[float, ...]
    home: int
    stories: tuple[Story | str, ...]


@dataclass(frozen=True, eq=False)
class Story:
    """Everything that a page needs, already computed; the writers in this package only draw it.

    title, summary: plain text; t: (n,) [s], strictly increasing; bodies: unique names; poses: (n,
    len(bodies), 4, 4), body to world, z up; parts, plots: see `Part`, `Plot`; facts: (label, text) pairs such as
    parameters and settings; health: (severity, sentence) pairs, severity one of ok, warning, error; traces:
    name -> (n, 3) points [m]; reconstructed: bodies whose poses were not computed by the solver but rebuilt
    from its result. arrows, marks: see `Arrow`, `Mark`. ghost: (1 or n, len(bodies), 4, 4) poses to compare with, named
    `ghost_name`; visible at the start if `ghost_shown`; ghost_parts: its parts (default: parts); ghost_traces:
    its paths, (n, 3) each. differences: (what, here, in the compared run). tooth_rate: largest rate at which teeth pass
    [1/s]; playback: a sentence on how far the picture between two frames may be off. explore: the page opens
    to be moved by hand, see `mechlab.viewer.explore`; variants: parameters that can be changed there, one at a time.
    floors: drawn instead of the page's own floor;
    model: the mechanism whose bodies, drawn shafts and ground `bodies` are, which the page solves;
    knots: coordinates of it, from which the page has its poses instead of `poses`, see `mechlab.viewer.knots`;
    named: parameters of the definition that numbers of the model follow, see `mechlab.viewer.named_numbers`;
    channels: all that were recorded, for plots that are asked for in the page; clips: parts
    of the story that buttons play one at a time; fields: quantities that colour the surface of a part. Raises
    MechlabError, naming the culprit, for anything that does not fit together.
    """

    title: str
    summary: str
    t: Array
    bodies: tuple[str, ...]
    poses: Array
    parts: tuple[Part, ...]
    plots: tuple[Plot, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    health: tuple[tuple[Severity, str], ...] = ()
    traces: Mapping[str, Array] = field(default_factory=dict)
    reconstructed: tuple[str, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    marks: tuple[Mark, ...] = ()
    ghost: Array | None = None
    ghost_name: str = ""
    ghost_shown: bool = False
    ghost_parts: tuple[Part, ...] = ()
    ghost_traces: Mapping[str, Array] = field(default_factory=dict)
    differences: tuple[tuple[str, str, str], ...] = ()
    tooth_rate: float = 0.0
    playback: str = ""
    explore: Exploration | None = None
    variants: tuple[Variation, ...] = ()
    floors: tuple[Floor, ...] = ()
    model: Mechanism | None = None
    knots: Knots | None = None
    named: NamedNumbers | None = None
    channels: Channels = field(default_factory=Channels)
    clips: tuple[Clip, ...] = ()
    fields: tuple[ColorField, ...] = ()

    def __post_init__(self) -> None:
        t = frozen(self.t, "t", (None,))
        if not len(t) or np.any(np.diff(t) <= 0.0):
            raise MechlabError("t: expected at least one time, strictly increasing.")
        bodies = tuple(str(b) for b in self.bodies)
        repeated = sorted({b for b in bodies if bodies.count(b) > 1})
        if repeated:
            raise MechlabError(f"bodies: every name must be unique, but these repeat: {', '.join(repeated)}.")
        poses = frozen(self.poses, "poses", (len(t), len(bodies), 4, 4))
        check_rigid(poses, "poses")
        for name in (
            *(part.body for part in (*self.parts, *self.ghost_parts)),
            *(m.body for m in self.marks),
            *self.reconstructed,
        ):
            if name not in bodies:
                raise unknown("body", name, bodies)
        plots = tuple(
            Plot(
                p.title,
                p.unit,
                {k: frozen(v, f"plot {p.title!r}, series {k!r}", (len(t),), finite=False) for k, v in p.series.items()},
                {
                    k: frozen(v, f"plot {p.title!r}, against {k!r}", (len(t),), finite=False)
                    for k, v in p.against.items()
                },
            )
            for p in self.plots
        )
        for severity, sentence in self.health:
            if severity not in get_args(Severity):
                raise MechlabError(
                    f"health: severity {severity!r} of {sentence!r} must be one of {', '.join(get_args(Severity))}."
                )
        traces = {k: frozen(v, f"trace {k!r}", (len(t), 3)) for k, v in self.traces.items()}
        ghost_traces = {k: frozen(v, f"ghost's trace {k!r}", (len(t), 3)) for k, v in self.ghost_traces.items()}
        arrows = tuple(
            Arrow(
                a.name, a.kind, a.unit,
                frozen(a.points, f"arrow {a.name!r}: points", (len(t), 3)),
                frozen(a.vectors, f"arrow {a.name!r}: vectors", (len(t), 3)), a.on, a.by,
            )
            for a in self.arrows
        )  # fmt: skip
        if self.ghost is not None:
            frames = 1 if len(np.shape(self.ghost)) and np.shape(self.ghost)[0] == 1 else len(t)
            ghost = frozen(self.ghost, "ghost", (frames, len(bodies), 4, 4))
            check_rigid(ghost, "ghost")
            object.__setattr__(self, "ghost", ghost)
        for name, value in (
            ("t", t),
            ("arrows", arrows),
            ("bodies", bodies),
            ("poses", poses),
            ("plots", plots),
            ("traces", traces),
            ("ghost_traces", ghost_traces),
            ("parts", tuple(self.parts)),
            ("reconstructed", tuple(self.reconstructed)),
            ("facts", tuple((str(a), str(b)) for a, b in self.facts)),
            ("health", tuple(self.health)),
        ):
            object.__setattr__(self, name, value)

    def frame(self, time: float | None = None) -> int:
        """Index of the recorded time nearest to `time` [s]; the first one without a time."""
        return 0 if time is None else int(np.abs(self.t - time).argmin())


def from_poses(
    title: str,
    poses: Mapping[str, ArrayLike],
    parts: Iterable[Part],
    *,
    t: ArrayLike = (0.0,),
    summary: str = "",
    plots: Sequence[Plot] = (),
    facts: Mapping[str, str] | None = None,
    health: Sequence[tuple[Severity, str]] = (),
    traces: Mapping[str, ArrayLike] | None = None,
    reconstructed: Sequence[str] = (),
) -> Story:
    """A Story from poses by body name: body -> (n, 4, 4), or (4, 4) for one that stands still.

    Without `t`, a still story of one frame. Raises MechlabError like Story.
    """
    times = frozen(t, "t", (None,))
    stack = []
    for name, value in poses.items():
        matrices = np.asarray(value, dtype=np.float64)
        if matrices.shape == (4, 4):
            matrices = np.broadcast_to(matrices, (len(times), 4, 4))
        stack.append(frozen(matrices, f"poses of body {name!r}", (len(times), 4, 4)))
    everything = np.stack(stack, axis=1) if stack else np.zeros((len(times), 0, 4, 4))
    return Story(
        title,
        summary,
        times,
        tuple(poses),
        everything,
        tuple(parts),
        tuple(plots),
        tuple((facts or {}).items()),
        tuple(health),
        {k: np.asarray(v, dtype=np.float64) for k, v in (traces or {}).items()},
        tuple(reconstructed),
    )
