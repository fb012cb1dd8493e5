"""The ledger of the delta: every verdict, that it follows from the numbers, and that it can be written to JSON."""

import importlib
import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from mechlab.catalog.delta6 import ENTRY
from mechlab.catalog.delta6.parameters import SOURCE
from mechlab.experiment.entry import ClaimResult, Verdict
from mechlab.kit.claims import same_digits
from mechlab.studies.check.claims import ClaimReport

CLAIMS = ENTRY.claims
BY_ID = {c.id: c for c in CLAIMS}
HOLDS, ONLY_IF, MISPRINT, FAILS, CANNOT = (
    Verdict.HOLDS,
    Verdict.HOLDS_ONLY_IF,
    Verdict.MISPRINT,
    Verdict.FAILS,
    Verdict.CANNOT,
)

VERDICTS: dict[str, tuple[Verdict, str]] = {
    "C01": (ONLY_IF, "could not turn"),
    "C02": (HOLDS, ""),
    "C03": (HOLDS, ""),
    "C04": (HOLDS, "local"),
    "C05": (ONLY_IF, "3 rotations"),
    "C06": (HOLDS, "for O"),
    "C07": (FAILS, "50 mm off O"),
    "C08": (HOLDS, "not claimed, nor true: the forces of the sliders change by 2.2 %"),
    "C09": (ONLY_IF, "in phase"),
    "C10": (ONLY_IF, "the introduction.*beta = \\+-90 deg"),
    "C11": (ONLY_IF, "the introduction.*type I"),
    "C12": (HOLDS, "no proof"),
    "C13": (HOLDS, ""),
    "C14": (HOLDS, "below the platform"),
    "C15": (ONLY_IF, "gamma. < 90 deg.*gamma = -g"),
    "C16": (ONLY_IF, "order zyx"),
    "C17": (ONLY_IF, "beta is not"),
    "C18": (ONLY_IF, "k_vz.*= 1"),
    "C19": (ONLY_IF, "about -Z"),
    "C20": (ONLY_IF, "turned away from home"),
    "C21": (HOLDS, ""),
    "C22": (HOLDS, ""),
    "C23": (HOLDS, ""),
    "C24": (ONLY_IF, "55 of 811"),
    "C25": (HOLDS, "every digit"),
    "C26": (HOLDS, ""),
    "C27": (ONLY_IF, "more digits than printed.*1.80, -0.07"),
    "C28": (MISPRINT, "swapped"),
    "C29": (MISPRINT, "B = -I"),
    "C30": (HOLDS, ""),
    "C31": (ONLY_IF, "not a body of revolution"),
    "C32": (ONLY_IF, "m g d cos"),
    "C33": (HOLDS, ""),
    "C34": (HOLDS, ""),
    "C35": (CANNOT, "both orders"),
    "C36": (ONLY_IF, "go to zero.*three angles 4.7 times"),
    "C37": (ONLY_IF, "model is exact"),
    "C38": (ONLY_IF, "20 teeth.*0.1300, -0.0480"),
    "C39": (CANNOT, "module 30 mm"),
    "C40": (HOLDS, ""),
    "C41": (MISPRINT, "9.09 deg from the normal"),
    "C42": (ONLY_IF, "11/17, 1, 31/30 and 6/5.*are ours"),
    "C43": (CANNOT, "no simple product"),
    "C44": (ONLY_IF, "cumulative"),
    "C45": (HOLDS, ""),
    "C46": (ONLY_IF, "no friction.*1.0013.*1.4 %"),
    "C47": (ONLY_IF, "19:19 approach"),
    "C48": (CANNOT, "tooth numbers are not given"),
    "C49": (ONLY_IF, "stands .nearly. still"),
    "C50": (ONLY_IF, "upper bound.*49 % too long"),
    "C51": (HOLDS, "u = 0.827 instead of 0.890"),
    "C52": (ONLY_IF, "sgn 0 is taken as .1"),
    "C53": (ONLY_IF, "border f = 0"),
    "C54": (ONLY_IF, "corners are left out"),
    "C55": (ONLY_IF, "f is not 0.*three values"),
    "C56": (ONLY_IF, "gains are in the printed order.*0.457 rad"),
    "C57": (Verdict.UNREADABLE, "just below it"),
}


@lru_cache(maxsize=1)
def findings() -> dict[str, ClaimResult]:
    return {c.id: c.test() for c in CLAIMS}


def numbers(finding: ClaimResult, pattern: str) -> list[Any]:
    found = [v for k, v in finding.computed.items() if re.search(pattern, k)]
    assert found, f"{pattern} not in {list(finding.computed)}"
    return found


def test_the_ledger_is_complete() -> None:
    assert [c.id for c in CLAIMS] == list(VERDICTS)
    assert all(c.where and c.text and c.source for c in CLAIMS)
    assert len({(c.where, c.text) for c in CLAIMS}) == len(CLAIMS)


@pytest.mark.parametrize("id_", VERDICTS)
def test_verdict(id_: str) -> None:
    verdict, words = VERDICTS[id_]
    found = findings()[id_]
    assert found.verdict is verdict, found.sentence
    assert re.search(words, found.because), found.sentence
    assert found.computed
    assert found.because or verdict is HOLDS
    json.dumps({"printed": BY_ID[id_].printed, "computed": found.computed}, allow_nan=False)


def test_the_ledger_can_be_read() -> None:
    report = ClaimReport(tuple(("delta6", c, findings()[c.id]) for c in CLAIMS))
    text = report.text()
    assert all(f"delta6 {c.id} ({c.source.label}, {c.where})" in text for c in CLAIMS)
    assert sum(report.counts.values()) == len(CLAIMS)


def test_numbers_of_the_specification() -> None:
    f = findings()
    # By hand: |phi_1'| for |omega| = 1 is the norm of ((kx + kN s) / c, -kx, kN), s, c of beta, kx = 0.783, kN = 1.4.
    for tilt in (0.0, 60.0, 80.0, 89.0, 89.99):
        s, c = np.sin(np.radians(tilt)), np.cos(np.radians(tilt))
        by_hand = np.linalg.norm([(0.783 + 1.4 * s) / c, 0.783, 1.4])
        assert numbers(f["C10"], f"rate of a drive at {tilt:g} deg")[0] == pytest.approx(by_hand, rel=1e-9)
    # The largest error of a double cardan 90 deg out of phase, asin((1 - k) / (1 + k)), k = cos^2(bend).
    k = np.cos(SOURCE.home_bend) ** 2
    out = numbers(f["C09"], "90 deg out of phase")
    np.testing.assert_allclose(out, np.degrees(np.arcsin((1 - k) / (1 + k))), atol=1e-7)
    np.testing.assert_allclose(out, 13.5573, atol=5e-5)
    # Of e'' + kv e' + kp e = 0: integral of e'^2 = (v0^2 + kp e0^2) / (2 kv), and that of e^2 by the equation times e.
    e, v, kv, kp = np.array([0.05, 0.0, 0.3]), np.array([-0.4, 0.8, -0.6]), 240.0, 480.0
    whole = ((e * v + (v**2 + kp * e**2) / (2 * kv) + kv * e**2 / 2) / kp).sum()
    # The trapezoidal rule with 0.5 ms, and 10 s instead of for ever: below 1e-4 together.
    assert numbers(f["C36"], "e.2, velocity 240")[0] == pytest.approx(whole, rel=1e-4)
    assert numbers(f["C08"], "change of the inertia") == pytest.approx([0.0, 0.0], abs=1e-12)
    turned = np.array(numbers(f["C20"], "turned")[0][1])
    # omega = alpha' e1 + gamma' e3 with e1 = Rz(0.7) Ry(-0.5) ex, alpha' = -kN / kx, gamma' = 1.
    e1 = [np.cos(0.5) * np.cos(0.7), np.cos(0.5) * np.sin(0.7), np.sin(0.5)]
    np.testing.assert_allclose(turned, -1.4 / 0.783 * np.array(e1) + [0, 0, 1], atol=1e-9)
    assert numbers(f["C11"], "edge of the reach")[0] == pytest.approx(0.1420, abs=5e-5)
    assert numbers(f["C12"], "smallest .det")[0] == pytest.approx(0.777, abs=5e-4)
    assert [numbers(f["C24"], f"nodes .*up to {b} deg")[0] for b in (90, 60, 45, 40, 35)] == [811, 362, 55, 4, 0]
    np.testing.assert_allclose(numbers(f["C27"], "printed matrices")[0], [1.27069, 1.79764, -0.06897], atol=5e-6)
    np.testing.assert_allclose(numbers(f["C28"], "mujoco")[0], [-0.5109, 0, 1], atol=5e-5)
    assert numbers(f["C35"], "below 1 mrad") == pytest.approx([2.83, 11.39], abs=5e-3)
    assert numbers(f["C35"], "damping ratio") == pytest.approx([5.48, 15.5], rel=2e-3)
    assert numbers(f["C35"], "error of gamma at 2 s") == pytest.approx([0.0053, 0.11], rel=0.01)
    assert numbers(f["C37"], "0.8 of the truth")[0] == pytest.approx(1.5e-3, abs=5e-5)
    np.testing.assert_allclose(numbers(f["C44"], "cumulative")[0], [5.0, 14.5, 23.2, 23.4], atol=0.06)
    assert numbers(f["C48"], "loss factor of stage") == pytest.approx([1.0501, 1.0758], abs=2e-4)  # two decimals


def test_witnesses_agree() -> None:
    pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    for id_ in ("C06", "C07", "C20", "C21", "C26", "C27", "C28", "C30", "C33"):
        said = {
            k: np.asarray(v)
            for k, v in findings()[id_].computed.items()
            if k.split(":")[0] in ("numpy", "pinocchio", "mujoco")
        }
        assert len({k.split(":")[0] for k in said}) == 3, id_
        first, *others = said.values()
        for other in others:
            np.testing.assert_allclose(other, first, atol=1e-8)


# -- the verdict follows from the numbers --------------------------------------------------------------------------------


def part(name: str) -> Any:
    return importlib.import_module(f"mechlab.catalog.delta6.{name}")


BALANCED = replace(SOURCE, head_offset=0.0)
# A of the geometry with B = 0.58 I: more digits than are printed
DIGITS = np.array([[-0.39159, 0.23374, -0.58277], [-0.00663, -0.456, -0.58277], [0.39822, 0.22226, -0.58277]]) * (
    0.58 / 0.58277
)
ROUGHER = np.array([50.0, 33.97, 37.05, 41.19, 51.0])

OTHERWISE: list[tuple[str, str, str, Any, Verdict]] = [
    ("C07", "claims_mobility", "SOURCE", BALANCED, HOLDS),
    ("C10", "claims_mobility", "SOURCE", replace(SOURCE, k_transfer=SOURCE.k_transfer / 10**6), FAILS),
    ("C25", "velocity_example", "PRINTED_A", part("velocity_example").PRINTED_A * 1.01, CANNOT),
    ("C26", "velocity_example", "PRINTED_B", -part("velocity_example").PRINTED_B, MISPRINT),
    ("C27", "velocity_example", "PRINTED_A", DIGITS, HOLDS),
    ("C28", "velocity_example", "PRINTED_ROTATION", np.diag([1.0, 2.0, 1.0]), FAILS),
    ("C29", "velocity_example", "PRINTED_ROTATION", -part("velocity_example").PRINTED_ROTATION, HOLDS),
    ("C30", "velocity_example", "SOURCE", replace(SOURCE, k_spur=SOURCE.k_spur * 2), MISPRINT),
    ("C32", "claims_head", "SOURCE", BALANCED, HOLDS),
    ("C35", "claims_head", "GAINS", {"a": (240.0, 480.0), "b": (-1.0, 240.0)}, HOLDS),
    ("C35", "claims_head", "GAINS", {"a": (-1.0, 480.0), "b": (480.0, 240.0)}, MISPRINT),
    ("C36", "claims_head", "GAINS", {"critical": (2.0 * 480.0**0.5, 480.0)}, HOLDS),
    ("C56", "claims_head", "GAINS", {"velocity 240, position 480": (480.0, 240.0), "velocity 480, position 240": (480.0, 240.0)}, FAILS),
    ("C56", "claims_head", "GAINS", {"velocity 240, position 480": (240.0, 480.0), "velocity 480, position 240": (240.0, 480.0)}, HOLDS),
    ("C57", "claims_head", "GAINS", {"velocity 240, position 480": (0.1, 1.0)}, FAILS),
    ("C38", "claims_mesh", "PRINTED_CONTACT", (0.023579, 0.064782), HOLDS),
    ("C38", "claims_mesh", "PRINTED_SLIDING", (0.1234, -0.0472), MISPRINT),
    ("C39", "claims_mesh", "PRINTED_RADIUS", 0.03, HOLDS),
    ("C40", "claims_mesh", "PRINTED_SLIDING", (0.1296, 0.0472), FAILS),
    ("C41", "claims_mesh", "FRICTION", 1.0, HOLDS),
    ("C36", "claims_head", "GAINS", {"no damping": (0.0, 480.0)}, FAILS),
    ("C42", "claims_mesh", "FREE", np.array([50.0, 32.45, 32.35, 33.43, 40.12]), CANNOT),
    ("C43", "claims_mesh", "FREE", np.array([50.0, 32.35, 32.35, 33.43, 50.0 * 0.783]), ONLY_IF),
    ("C44", "claims_mesh", "ROUGH", np.array([50.0, 33.97, 37.05, 41.19, 60.0]), MISPRINT),
    ("C45", "claims_mesh", "ROUGH", ROUGHER, MISPRINT),
    ("C46", "claims_mesh", "ROUGH", ROUGHER, HOLDS),
    ("C47", "claims_mesh", "ROUGH", np.array([50.0, 33.97, 39.05, 41.19, 49.49]), CANNOT),
]  # fmt: skip


@pytest.mark.parametrize(("id_", "name", "attribute", "value", "verdict"), OTHERWISE)
def test_other_numbers_give_another_verdict(
    id_: str, name: str, attribute: str, value: Any, verdict: Verdict, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(part(name), attribute, value)
    assert BY_ID[id_].test().verdict is verdict, BY_ID[id_].test().sentence


def patched(where: str, name: str, make: Callable[[Any], Any]) -> Callable[[pytest.MonkeyPatch], None]:
    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        module = importlib.import_module(where)
        monkeypatch.setattr(module, name, make(getattr(module, name)))

    return patch


DELTA = "mechlab.catalog.delta6."
CLOSED = "mechlab.analytic.delta6"

MUTATED: list[tuple[str, Callable[[pytest.MonkeyPatch], None], Verdict]] = [
    ("C01", patched(CLOSED, "somov_malyshev", lambda f: lambda *a: 3), HOLDS),
    ("C02", patched(CLOSED, "chebyshev", lambda f: lambda *a: f(*a) + 1), FAILS),
    ("C03", patched(CLOSED, "artobolevsky", lambda f: lambda *a: f(*a) + 1), FAILS),
    ("C09", patched(DELTA + "elements", "output_turns", lambda f: lambda w, x: np.asarray(x)), HOLDS),
    ("C09", patched(DELTA + "elements", "output_turns", lambda f: lambda w, x: f(w, x) * 1.001), FAILS),
    ("C12", patched(DELTA + "claims_mobility", "_rod_triples", lambda f: lambda x: f(x) + 0.9), FAILS),
    ("C15", patched(CLOSED, "printed_turn_back", lambda f: lambda e: -np.arctan2(e[..., 1], e[..., 0])), HOLDS),
    ("C15", patched(CLOSED, "printed_turn_back", lambda f: lambda e: -f(e)), FAILS),
    ("C18", patched(CLOSED, "printed_drive_matrix", lambda f: lambda g: replace_k(g)), HOLDS),
    ("C24", patched(CLOSED, "workspace_counts", lambda f: lambda g, low, high, bend: f(g, low, high)), HOLDS),
    ("C33", patched(CLOSED, "generalized_forces", lambda f: lambda *a: -f(*a)), FAILS),
    ("C37", patched(DELTA + "claims_head", "_deviations", lambda f: lambda *a: [1e-9] * 3), HOLDS),
    ("C37", patched(DELTA + "claims_head", "_deviations", lambda f: lambda *a: [1.0] * 3), FAILS),
    ("C49", patched(DELTA + "claims_articles", "_off_centre", lambda f: lambda curve: curve), HOLDS),
    ("C49", patched("mechlab.analytic.bspline", "simpson_spans", lambda f: lambda c, n: 1.01 * f(c, n)), FAILS),
    ("C50", patched("mechlab.analytic.bspline", "control_polygon_length", lambda f: lambda c: 0.7 * f(c)), HOLDS),
    ("C50", patched("mechlab.analytic.bspline", "control_polygon_length", lambda f: lambda c: 0.5 * f(c)), FAILS),
    ("C53", patched(DELTA + "claims_articles", "SMOOTH", lambda f: type(f)("wrong", np.add, f.join)), FAILS),
    (
        "C53",
        patched(DELTA + "claims_articles", "indicator", lambda f: lambda x: (np.asarray(x) > 0).astype(int)),
        HOLDS,
    ),
    ("C54", patched(DELTA + "claims_articles", "SMOOTH", lambda f: type(f)("min", np.minimum, np.maximum)), FAILS),
    (
        "C48",
        patched(DELTA + "claims_mesh", "tooth_loss", lambda f: lambda *a: 1.0501 if a[0] < a[1] else 1.0758),
        ONLY_IF,
    ),
]


def replace_k(geom: Any) -> Any:
    from mechlab.analytic.delta6.rotation import drive_matrix

    return drive_matrix(geom)


@pytest.mark.parametrize(("id_", "mutate", "verdict"), MUTATED)
def test_other_closed_forms_give_another_verdict(
    id_: str, mutate: Callable[[pytest.MonkeyPatch], None], verdict: Verdict, monkeypatch: pytest.MonkeyPatch
) -> None:
    mutate(monkeypatch)
    assert BY_ID[id_].test().verdict is verdict, BY_ID[id_].test().sentence


@pytest.mark.parametrize(
    ("value", "printed", "decimals", "expected"),
    [
        ([1.2749], [1.27], 2, True),
        ([1.2751], [1.27], 2, False),
        ([-0.0649], [-0.06], 2, True),
        ([0.39, 0.2334], [0.39, 0.233], [2, 3], True),
        ([0.39, 0.2336], [0.39, 0.233], [2, 3], False),
    ],
)
def test_same_digits(value: list[float], printed: list[float], decimals: Any, expected: bool) -> None:
    assert same_digits(value, printed, decimals) is expected
