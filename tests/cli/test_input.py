"""What a user may write behind the equals sign: units, ranges, hostile numbers; no traceback whatever comes."""

import json
import math
import random

import pytest

import mechlab as ml
from mechlab import catalog
from mechlab.cli import VERBS, main
from mechlab.errors import MechlabError
from mechlab.experiment.parameters import question_units

WRONG = [
    ("solve fourbar crank_angle=5mm", "crank_angle: expected an angle (rad, mrad, deg, ...), got 5mm"),
    ("solve fourbar crank_angle=1 crank_rate=5kg", "crank_rate: expected a rate of turning"),
    ("solve closed_differential w_H1=5kg", "w_H1: expected a rate of turning"),
    ("solve platform_3rrr x=0kg y=0 alpha=0", "x: expected a length"),
    ("solve delta6 q1=1deg q2=1 q3=1 phi1=0 phi2=0 phi3=0", "q1: expected a length"),
    ("solve planetary sun_rate=1 sun_force=3N", "sun_force: expected a torque"),
    ("simulate pendulum angle_0=3kg", "angle_0: expected an angle"),
    ("simulate pendulum angle_rate_0=3m", "angle_rate_0: expected a rate of turning"),
    ("simulate pendulum angle_force=3N", "angle_force: expected a torque"),
    ("simulate pendulum --duration 3kg", "--duration"),
    ("simulate pendulum --at 3m", "--at"),
    ("sweep fourbar crank_angle=0mm:10mm:3", "crank_angle: expected an angle"),
    ("workspace delta6 x=-.06kg:.06kg:3", "x: expected a length"),
    ("cycle fourbar crank_angle_rate=3kg", "crank_angle_rate: expected a rate of turning"),
    ("modes fourbar crank_angle_0=3kg", "crank_angle_0: expected an angle"),
    ("solve fourbar crank_angle=nan:.2", "expected a finite number, got 'nan'"),
    ("solve fourbar crank_angle=0:1:1000000000", "a range has at most 100000000 points"),
    ("solve fourbar crank_angle=" + "0" * 5000, "a number has at most 1000 characters, got 5000"),
    ("optimize fourbar crank=nan:.2 --maximize crank", "expected a finite number, got 'nan'"),
    ("simulate pendulum --duration 1e7", "duration must be at most 1e+06 s, got 1e+07 s"),
    ("simulate pendulum --timestep 1e-12", "makes 1e+13 steps; at most 5e+07 are run"),
    ("solve fourbar crank=1e308 coupler=1e308 rocker=1e308 ground=1e308 crank_angle=1", "beyond 1e+50"),
    ("solve fourbar gravity=" + "1" * 400 + " crank_angle=1", "outside the range of a double"),
]


@pytest.mark.parametrize(("command", "text"), WRONG, ids=[c[:60] for c, _ in WRONG])
def test_bad_values_are_named_with_the_true_reason(capsys, command, text):
    assert main(command.split()) == 1
    err = capsys.readouterr().err
    assert text in err and err.count("\n") == 1


def test_text_with_units_works_from_python():
    by_text = ml.solve("fourbar", crank_angle="37deg")
    by_number = ml.solve("fourbar", crank_angle=math.radians(37.0))
    assert abs(by_text["analytic"]["rocker_angle"] - by_number["analytic"]["rocker_angle"]) < 1e-15
    assert ml.load("fourbar", crank="100mm").parameters.crank == 0.1
    with pytest.raises(MechlabError, match="got 37mm"):
        ml.solve("fourbar", crank_angle="37mm")


@pytest.mark.parametrize("name", catalog.NAMES)
def test_every_given_key_of_a_question_has_a_unit(name):
    for question in catalog.entry(name).questions:
        assert {*question.given, *question.optional} <= set(question_units(question))


SEED = 12
NUMBERS = "0 1 -1 .3 1e-300 1e308 1e400 nan inf 37deg 5mm 3kg 300rpm 1/3 1/0 0:1 0:1:3 0:1:0 1:0:2 nan:1 a,b 1,2 , : 1e 0x1 °".split()
NUMBERS += ["", "1" * 450, "٣", "1\u2212", "--", "none", "[]", "1;2", "=", "1=2", "\udce4"]
FUZZED = sorted(set(VERBS) - {"run", "chart", "view", "generate", "claims", "stability", "check"})
OPTIONS = {
    "simulate": ["--duration", "--timestep", "--at", "--max-error"],
    "cycle": ["--points", "--span"],
    "optimize": ["--evaluations", "--subject"],
    "sweep": ["--quantity"],
}


def hostile_command(rng: random.Random) -> list[str]:
    """A verb with good, bad and mutilated names, keys, values and options."""
    verb = rng.choice(FUZZED)
    name = rng.choice(["fourbar", "pendulum", "planetary_stage", "fivebar", "fourbar", "nothing", "x.xml", "toolpath"])
    keys = [
        "crank",
        "crank_angle",
        "crank_angle_rate",
        "crank_rate",
        "angle",
        "angle_0",
        "length",
        "gravity",
        "teeth",
        "sun_rate",
    ]
    words = [verb, name]
    for key in rng.sample(keys, rng.randint(0, 3)):
        key = rng.choice([key, key, key, key + "_rate", key[:-1], key.upper(), "", key + " "])
        words.append(f"{key}={rng.choice(NUMBERS)}")
    for option in rng.sample(OPTIONS.get(verb, []), min(1, len(OPTIONS.get(verb, [])))):
        words.append(f"{option}={rng.choice(NUMBERS)}")
    if verb == "simulate":
        words += ["--duration=.01"] if not any(w.startswith("--duration") for w in words) else []
    return [*words, "--json"]


@pytest.mark.parametrize("k", range(15))
def test_hostile_input_never_breaks_the_command_line(capsys, k):
    rng = random.Random(100 * SEED + k)
    for _ in range(10):
        words = hostile_command(rng)
        code = main(words)
        out, err = capsys.readouterr()
        assert code in (0, 1, 2, 3, 4), words
        assert "internal error" not in err and "Traceback" not in err, (words, err)
        assert json.loads(out)["exit_code"] == code, words
