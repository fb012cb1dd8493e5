"""An entry of the catalog: a mechanism with its parameters, scenes, questions, checks and claims."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mechlab.experiment.check import Check, Claim
from mechlab.experiment.question import Question
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.experiment.workspace import WorkspaceRecipe
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


@dataclass(frozen=True)
class SceneRecipe:
    """How a scene is made: `make(parameters, fidelity) -> Scene`; `overrides` are parameters it changes before the user's."""

    make: Callable[[Any, str], Scene]
    fidelity: str
    text: str
    overrides: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Entry:
    """What a catalog file exports.

    parameters: a frozen dataclass of `parameter(...)` fields. build(p, fidelity) -> Mechanism, for every fidelity except
    "kinematic". reference(p, scene) -> Recording: closed form or own equations. expand(p, recording) -> the richest
    Mechanism and its coordinates (n, nq) along the recording, for the page. channels: more channels, name -> (unit,
    function(parameters, recording) -> (n,)). warnings(p) -> sentences on doubtful parameters;
    remarks(p) -> what `show` says of this design. figure(path) draws the
    verdict on the claims; the kind of file follows the suffix.
    portraits: kind -> function(parameters, given) -> `mechlab.study.portrait.Portrait`; given: numbers or arrays by name.
    sliders: up to two parameters (lengths) that the page of explore mode can change.
    workspace: the poses it can take, as a region; without it a workspace is found by asking a question at every node.
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
    figure: Callable[[Path], None] | None = None
    portraits: Mapping[str, Callable[[Any, Mapping[str, Any]], Any]] = field(default_factory=dict)
    workspace: WorkspaceRecipe | None = None
    sliders: tuple[str, ...] = ()
    chain: str = ""
    formulas: str = ""
    sources: tuple[str, ...] = ()
