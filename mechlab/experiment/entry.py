"""An entry of the catalog: a mechanism with its parameters, scenes, questions, checks, claims and workspace, all as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError, explained
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.publication import Publication
from mechlab.experiment.question import Question
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.values import Range

if TYPE_CHECKING:
    from mechlab.analytic.regions import Region
    from mechlab.experiment.figure import SourceFigure

Coordinates = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True)
class WorkspaceMap:
    """A quantity over the workspace, for example a dexterity: function(axis -> coordinates) of the axes `axes`."""

    function: Callable[[Coordinates], NDArray[np.float64]]
    axes: tuple[str, ...]
    unit: str = ""
    text: str = ""


@dataclass(frozen=True)
class WorkspaceLimit:
    """A limit that can be given in addition to the parameters."""

    unit: str
    text: str


@dataclass(frozen=True)
class WorkspaceRecipe:
    """The workspace of an entry. make(parameters, limits) -> region of poses, where limits holds those that the user
    gives.

    grid: axis -> default range; units: axis -> unit; maps(parameters) -> quantities to map over the region; text:
    meaning of a node.
    """

    make: Callable[[Any, Mapping[str, float]], Region]
    grid: Mapping[str, Range]
    units: Mapping[str, str]
    limits: Mapping[str, WorkspaceLimit] = field(default_factory=dict)
    maps: Callable[[Any], Mapping[str, WorkspaceMap]] = lambda p: {}
    text: str = ""


@explained
@dataclass(frozen=True)
class CheckResult:
    """The values of a check. `values`: witness -> number or array; `expected`: the reference value, or None when the
    witnesses are compared with the first of them; `tolerance`: absolute. The check passes when all agree."""

    values: dict[str, Any]
    tolerance: float
    expected: Any = None
    note: str = ""

    @property
    def difference(self) -> float:
        """Largest absolute difference; infinite when a value is missing, not finite, or of another shape."""
        if not self.values or (self.expected is None and len(self.values) < 2):
            return float("inf")
        arrays = {k: np.asarray(v, dtype=float) for k, v in self.values.items()}
        reference = np.asarray(self.expected, dtype=float) if self.expected is not None else next(iter(arrays.values()))
        worst = 0.0
        for array in arrays.values():
            if array.shape != reference.shape or not np.all(np.isfinite(array)):
                return float("inf")
            worst = max(worst, float(np.max(np.abs(array - reference), initial=0.0)))
        return worst

    @property
    def passed(self) -> bool:
        """True when the difference is within the tolerance."""
        return self.difference <= self.tolerance


@explained
@dataclass(frozen=True)
class Check:
    """A named check of a mechanism: `run(parameters) -> CheckResult`. `source` says where the expected value comes from."""

    id: str
    text: str
    run: Callable[[Any], CheckResult]
    source: str = ""
    slow: bool = False


class Verdict(Enum):
    """The verdict on a printed statement."""

    HOLDS = "holds"
    HOLDS_ONLY_IF = "holds only if"
    MISPRINT = "misprint, correct is"
    UNREADABLE = "unreadable in the scan"
    FAILS = "fails"
    CANNOT = "cannot be checked"


@explained
@dataclass(frozen=True)
class ClaimResult:
    """The test of a claim: the number that each witness computes, the verdict, and its reason in words."""

    computed: dict[str, Any]
    verdict: Verdict
    because: str = ""

    @property
    def sentence(self) -> str:
        """The verdict as a sentence."""
        if not self.because:
            return self.verdict.value
        joint = " " if self.verdict in (Verdict.HOLDS_ONLY_IF, Verdict.MISPRINT) else ": "
        return f"{self.verdict.value}{joint}{self.because}"


@explained
@dataclass(frozen=True)
class Claim:
    """A printed statement of a source. `printed`: the number or sentence as printed; `test()` computes it again.

    id: unique within an entry; where: equation, figure or sentence of the source; formerly: an older id, if it had one. Raises
    MechlabError without a source or a place in it.
    """

    id: str
    where: str
    text: str
    printed: Any
    test: Callable[[], ClaimResult]
    source: Publication
    formerly: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.source, Publication):
            raise MechlabError(
                f"claim {self.id}: it has no source; give the Publication that prints it (mechlab.experiment.publication)."
            )
        if not self.where.strip():
            raise MechlabError(f"claim {self.id}: where does {self.source.label} print it? Give the equation, figure or section.")


@explained
@dataclass(frozen=True)
class SceneRecipe:
    """A function that makes a scene: `make(parameters, fidelity) -> Scene`; `overrides`: its own defaults of
    parameters, which values of the user replace."""

    make: Callable[[Any, str], Scene]
    fidelity: str
    text: str
    overrides: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class PlotRecipe:
    """A plot of every run, named by what it shows: `channels` that share a unit; with `over`, the ratio of each to that
    channel, which is left out where it stands still. Channels that a run does not have are left out."""

    title: str
    channels: tuple[str, ...]
    over: str = ""


@dataclass(frozen=True)
class Outside:
    """A number from outside of the lab: printed in a source, or derived by a formula that stands there.

    text: what it is; expected(parameters) by the outside formula; measured(parameters, motion) reads the same off the motion of one
    witness along the stated path, a mapping from the name of a quantity to its values (n,), see `mechlab.kit.path_motion`.
    tolerance: in its unit, of the formula (the printed digits, the terms that it leaves out).
    """

    text: str
    unit: str
    expected: Callable[[Any], float]
    measured: Callable[[Any, Mapping[str, Array]], float]
    tolerance: float
    source: str


@explained
@dataclass(frozen=True)
class Entry:
    """An entry of the catalog, which a catalog file exports.

    parameters: a frozen dataclass of `parameter(...)` fields.
    build(p, fidelity) -> Mechanism, for every fidelity except "kinematic".
    reference(p, scene) -> Recording: closed form or own equations.
    expand(p, recording) -> the richest Mechanism and its coordinates (n, nq) along the recording, for the page.
    channels: more channels, name -> (unit, function(parameters, recording) -> (n,)).
    warnings(p) -> sentences on doubtful parameters; remarks(p) -> sentences that `show` prints on this design.
    figures: figures of the sources, ours against what is printed.
    portraits: kind -> function(parameters, given) -> `mechlab.kit.portrait.Portrait`; given: numbers or arrays by name.
    plots: what the mechanism is for, as plots of its runs: the motion of its output, its ratio; the page shows them first.
    sliders: up to two parameters (lengths) that the page of explore mode can change.
    file: the model file of somebody's own that the mechanism was read from.
    workspace: the region of reachable poses; without it, a workspace is found by asking a question at every node.
    family: what people look for it under; origin: who invented it, and when; use: what it is for, in a sentence.
    outside: numbers from outside of the lab, each a check too.
    path(p): drive -> its first and last value [rad or m] on the way along which the mechanism is shown and measured.
    """

    name: str
    title: str
    summary: str
    parameters: type[Any]
    build: Callable[[Any, str], Mechanism]
    fidelities: Mapping[str, str]
    default_fidelity: str
    scenes: Mapping[str, SceneRecipe]
    default_scene: str
    questions: tuple[Question, ...] = ()
    checks: tuple[Check, ...] = ()
    claims: tuple[Claim, ...] = ()
    reference: Callable[[Any, Scene], Recording] | None = None
    expand: Callable[[Any, Recording], tuple[Mechanism, Array]] | None = None
    channels: Mapping[str, tuple[str, Callable[[Any, Recording], Array]]] = field(default_factory=dict)
    warnings: Callable[[Any], tuple[str, ...]] | None = None
    remarks: Callable[[Any], tuple[str, ...]] | None = None
    figures: tuple[SourceFigure, ...] = ()
    portraits: Mapping[str, Callable[[Any, Mapping[str, Any]], Any]] = field(default_factory=dict)
    workspace: WorkspaceRecipe | None = None
    sliders: tuple[str, ...] = ()
    plots: tuple[PlotRecipe, ...] = ()
    chain: str = ""
    formulas: str = ""
    sources: tuple[str, ...] = ()
    file: ModelFile | None = None
    family: str = ""
    origin: str = ""
    use: str = ""
    outside: tuple[Outside, ...] = ()
    path: Callable[[Any], Mapping[str, tuple[float, float]]] | None = None
