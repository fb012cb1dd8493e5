"""A user's script, as mypy --strict reads it: a mechanism of one's own, a scene with a law, answers, a run, a picture of it."""

from dataclasses import replace
from typing import reveal_type

from matplotlib.figure import Figure

import mechlab as ml


def rocker(crank: float = 0.1, ground: float = 0.3) -> ml.Mechanism:
    """A crank-rocker."""
    b = ml.Builder("rocker", gravity=(0, -9.81, 0))
    b.bar("crank", ml.revolute("crank_angle"), crank)
    b.bar("coupler", ml.revolute("coupler_joint"), 0.3, parent="crank", at=(crank, 0, 0), layer=0.02)
    b.bar("rocker", ml.revolute("rocker_angle"), 0.25, at=(ground, 0, 0), layer=0.04)
    b.loop("pin", "coupler", "rocker", at_a=(0.3, 0, 0), at_b=(0.25, 0, 0))
    return b.assemble({"crank_angle": 1.0, "coupler_joint": -0.6, "rocker_angle": 1.6}, hold=["crank_angle"])


def driven(parameters: object, fidelity: str) -> ml.Scene:
    """A motor on the crank against a constant load on the rocker."""
    laws = (ml.Motor("crank_angle", 2.0, 30.0), ml.Constant("rocker_angle", -0.2))
    return ml.Scene("driven", fidelity, 0.2, laws=laws)


design = ml.load(rocker, crank=0.09)
reveal_type(design)
answers = ml.solve(design, crank_angle=1.0)
reveal_type(answers)
reveal_type(answers["pinocchio"])
reveal_type(answers.max_difference)

entry = ml.find(rocker)
entry = replace(entry, scenes={**entry.scenes, "driven": ml.SceneRecipe(driven, "full", "a motor and a load")})
run = ml.simulate(entry, {"ground": 0.3}, scene="driven", engine="mujoco", timestep=5e-4, at=(0.1, 0.2))
reveal_type(run)
reveal_type(run.channel("rocker_angle"))
reveal_type(run.health.trusted)
print(run)

figure = Figure()
figure.add_subplot().plot(run.t, run["rocker_angle"])
reveal_type(ml.view(run, png="run.png"))
reveal_type(ml.sweep(design, {"crank_angle": ml.Range(0.0, 1.0, 5)}, "rocker_angle"))
