"""The result of a sweep: numbers over the axes, gaps with their reasons; also as one labelled dataset (xarray), and its netCDF file."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, install_extra, unknown
from mechlab.files import unfinished
from mechlab.formats.json_text import parse
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.results import Shown
from mechlab.studies.sweep.request import BAD_INPUT, GOOD, METHODS, NO_SOLUTION, UNTRUSTED, SweepAxis, SweepRequest

OF_A_RUN = ("engine", "fidelity", "duration", "timestep", "backend")
"""Settings that the dataset remembers."""
SMALL = 2000
"""Largest number of points that the JSON document lists; for a larger sweep it gives ranges only."""


@dataclass(frozen=True, repr=False)
class SweepResult(Shown):
    """A finished sweep. `flat` (points, quantities), `outcomes` (points,) and `reasons` (point -> sentence) are in the order
    of work; `result[label]`, `outcome` and `dataset` are over the axes in the user's order. evaluated: number of points
    computed now; the others come from an earlier, interrupted sweep. errors: label -> error of single precision, where runs were stepped
    in it (`mechlab.studies.sweep.precision`); no other error of runs is stated, but `step_error` where it is a quantity."""

    request: SweepRequest
    flat: Array
    outcomes: np.ndarray
    reasons: Mapping[int, str]
    evaluated: int
    command: str = ""
    files: Mapping[str, Path] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    errors: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, label: str) -> Array:
        """A quantity over the axes, NaN at gaps. Raises MechlabError for an unknown label."""
        labels = [q.label for q in self.request.quantities]
        if label not in labels:
            raise unknown(f"{self.request.name}: quantity of the sweep", label, labels)
        return self.request.in_users_order(self.flat[:, labels.index(label)])

    @cached_property
    def outcome(self) -> np.ndarray:
        """The outcome of each point, over the axes: 0 good, 1 bad input, 3 not to be trusted, 4 no solution."""
        return self.request.in_users_order(self.outcomes)

    @cached_property
    def reason(self) -> np.ndarray:
        """The reason of each gap, over the axes; "" at points without a gap."""
        flat = np.full(self.request.count, "", dtype=object)
        for i, text in self.reasons.items():
            flat[i] = text
        return self.request.in_users_order(flat)

    @cached_property
    def dataset(self) -> Any:
        """The result as an xarray.Dataset with names, units and provenance. Raises EngineMissing without xarray."""

        return dataset(self)

    @cached_property
    def counts(self) -> dict[str, int]:
        """Outcome -> number of points."""
        return {
            "good": int(np.count_nonzero(self.outcomes == GOOD)),
            "untrusted": int(np.count_nonzero(self.outcomes == UNTRUSTED)),
            "no_solution": int(np.count_nonzero(self.outcomes == NO_SOLUTION)),
            "bad_input": int(np.count_nonzero(self.outcomes == BAD_INPUT)),
        }

    @property
    def exit_code(self) -> int:
        """3 when a point cannot be trusted; else 0 when a point is good; else 4 when a point has no solution; else
        1."""
        found = self.counts
        if found["untrusted"]:
            return 3
        return 0 if found["good"] else 4 if found["no_solution"] else 1

    @property
    def message(self) -> str:
        """One sentence: the number of points of each outcome."""
        c = self.counts
        parts = [f"{c['good']} of {self.request.count} points are good"]
        parts += [f"{c[k]} {text}" for k, text in (
            ("untrusted", "cannot be trusted"), ("no_solution", "have no solution"), ("bad_input", "are bad input")) if c[k]]  # fmt: skip
        common = Counter(self.reasons.values()).most_common(1)
        return ", ".join(parts) + (f"; {common[0][0]}" if not c["good"] and common else "")

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; with all points when there are at most SMALL."""
        r = self.request
        out: dict[str, Any] = {
            "mechanism": r.name, "method": r.method, "points": r.count, "evaluated": self.evaluated, "counts": self.counts,
            "axes": {a.key: {"unit": a.unit, "values": list(a.coordinates)} for a in r.axes},
            "quantities": {q.label: {"unit": q.unit} | self._range(k) for k, q in enumerate(r.quantities)},
            "fixed": dict(r.parameters) | dict(r.given), "files": {k: str(v) for k, v in self.files.items()},
            "warnings": list(self.warnings), "message": self.message, "status": self._status(), "fingerprint": r.fingerprint,
        }  # fmt: skip
        if self.errors:
            out["errors"] = dict(self.errors)
        if r.count <= SMALL:
            out["data"] = {q.label: self[q.label] for q in r.quantities} | {
                "outcome": self.outcome,
                "reason": self.reason,
            }
        return out

    def _status(self) -> str:
        return {0: "answered", 1: "bad input", 3: "finished, do not trust all of it", 4: "no solution exists"}[
            self.exit_code
        ]

    def _range(self, k: int) -> dict[str, float | None]:
        x = self.flat[:, k]
        x = x[np.isfinite(x)]
        return {"least": float(x.min()), "largest": float(x.max())} if x.size else {"least": None, "largest": None}


HOW = install_extra("cluster")


def need_xarray() -> Any:
    """The package xarray; raises EngineMissing, saying what to install."""
    try:
        import xarray
    except ModuleNotFoundError as missing:
        raise EngineMissing(f"a dataset needs xarray ({missing.name} is missing): {HOW}.") from None
    return xarray


def dataset(result: SweepResult) -> Any:
    """An xarray.Dataset: a variable for each quantity over the axes, `outcome`, `reason`, and the provenance as
    attributes."""
    r = result.request
    dims = tuple(a.key for a in r.axes)
    variables: dict[str, Any] = {}
    for q in r.quantities:
        values = result[q.label]
        attributes: dict[str, Any] = {"long_name": f"{q.kind} {q.name}" + (f", {q.reduce}" if q.kind == "channel" else "")}
        if q.label in result.errors:
            attributes |= {"error_of_single_precision": result.errors[q.label]}
        variables[q.label] = (dims, values, attributes | ({"units": q.unit} if q.unit else {}))
    meaning = {
        "flag_values": np.array([0, 1, 3, 4], dtype=np.int8),
        "flag_meanings": "good bad_input untrusted no_solution",
    }
    variables["outcome"] = (dims, result.outcome, {"long_name": "how the point went"} | meaning)
    variables["reason"] = (dims, result.reason, {"long_name": "why there is a gap"})
    coords = {a.key: (a.key, a.coordinates, _attributes(a)) for a in r.axes}
    return need_xarray().Dataset(variables, coords, provenance(r, result.command))


def provenance(request: SweepRequest, command: str) -> dict[str, Any]:
    """Attributes of the dataset: mechanism, command, method, fixed values, settings, versions, fingerprint."""
    given = request.description()
    return {
        "title": f"sweep of {request.name} over {', '.join(a.key for a in request.axes)}", "mechanism": request.name,
        "command": command, "method": f"{request.method}: {METHODS[request.method]}", "witness": request.witness,
        "scene": request.scene or "", "parameters": json.dumps(given["parameters"]), "given": json.dumps(given["given"]),
        "settings": json.dumps({k: x for k in OF_A_RUN if (x := given.get(k)) is not None}),
        "versions": json.dumps(given["versions"]), "request": json.dumps(given, sort_keys=True), "fingerprint": request.fingerprint,
        "Conventions": "CF-1.11",
    }  # fmt: skip


def _attributes(axis: SweepAxis) -> dict[str, str]:
    """Attributes of an axis in the dataset."""
    attributes = {"long_name": axis.text or axis.key, "role": axis.role}
    return attributes | ({"units": axis.unit} if axis.unit else {})


def write_dataset(result: SweepResult, path: Path) -> Path:
    """Write netCDF-3 (64-bit offset), which every netCDF reader opens. An error leaves no incomplete file."""
    with unfinished(path) as temporary:
        result.dataset.to_netcdf(temporary, format="NETCDF3_64BIT", engine="scipy")
    return path


def read_dataset(path: Path) -> Any:
    """The dataset of a file, loaded into memory; raises MechlabError for a file that is not netCDF."""
    xarray = need_xarray()
    try:
        with xarray.open_dataset(path, engine="scipy") as found:
            return found.load()
    except Exception as cause:  # whatever a damaged file makes the readers of netCDF raise
        words = " ".join(str(cause).split())[:200].rstrip(".") or type(cause).__name__
        raise MechlabError(f"{path} is no netCDF file of a sweep: {words}.") from None


def kept_dataset(path: Path, request: SweepRequest) -> tuple[np.ndarray, np.ndarray, dict[int, str]] | None:
    """Numbers, outcomes and reasons, in the order of work, of a finished file of the same request; None where there is no
    file. Raises MechlabError where the file holds another sweep, naming what differs."""

    if not path.is_file():
        return None
    found = read_dataset(path)
    refuse_another(description_in(str(found.attrs.get("request", "{}")), path), request, path)
    order = [a.key for a in request.work]

    def flat(name: str) -> np.ndarray:
        return np.asarray(found[name].transpose(*order).values).ravel()

    try:
        reasons = {int(i): str(text) for i, text in enumerate(flat("reason")) if text}
        values, outcomes = np.column_stack([flat(q.label) for q in request.quantities]).astype(float), flat("outcome")
    except (KeyError, ValueError, TypeError) as cause:
        raise MechlabError(f"{path} is no complete file of a sweep: {cause}.") from None
    if values.shape != (request.count, len(request.quantities)) or outcomes.shape != (request.count,):
        raise MechlabError(f"{path} holds {len(values)} points, expected {request.count}.")
    return values, outcomes, reasons


def refuse_another(kept: Mapping[str, Any], request: SweepRequest, where: Path) -> None:
    """Raises MechlabError, naming what differs, where `kept` is the description of another request."""
    wanted = json.loads(json.dumps(request.description()))
    differ = [k for k in {*kept, *wanted} if kept.get(k) != wanted.get(k)]
    if not differ:
        return
    inner = []
    for k in sorted(differ):
        was, now = kept.get(k), wanted.get(k)
        if isinstance(was, dict) and isinstance(now, dict):
            inner += [f"{k} {x}" for x in sorted({*was, *now}) if was.get(x) != now.get(x)]
        else:
            inner.append(k)
    raise MechlabError(
        f"{where} holds another sweep: {', '.join(inner)} differ. Ask for the same, or remove it, or choose another file."
    )


def description_in(content: str | bytes, where: Path) -> dict[str, Any]:
    """The description of a request from its JSON; raises MechlabError, naming the file, for other content."""
    try:
        text = content if isinstance(content, str) else content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise MechlabError(f"{where} does not say what was wanted: {error}.") from None
    return parse(text, str(where), finite=False)
