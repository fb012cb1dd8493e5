"""Errors that --max-error states for every channel, against the truth: run it: python -m tests.benchmarks.channel_errors [target].

For each scene and channel the stated error, the true one (against the same scene at SHARP, or the entry's own equations), and
their ratio. Counts what is understated more than three times. What the truth itself leaves open (its own stated error) is
allowed for. Nothing is asserted.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.experiment.errors import largest_difference, shared_times
from mechlab.experiment.recording import Recording
from mechlab.lab.design import Design

SHARP = 1e-9
UNDERSTATED = 3.0
OWN = 1e-8
"""What own equations leave open, relative to the size of a channel."""
SCENES: tuple[tuple[str, str | None, float | None, dict[str, float]], ...] = (
    ("pendulum", None, 4.0, {}), ("slider_crank", None, None, {}), ("n_fourbar", None, 3.0, {"N": 3}), ("andrews", None, None, {}),
    ("bricard", None, 2.0, {}), ("flyball", None, 1.0, {}), ("fivebar", "driven-crank", 1.0, {}), ("fivebar", "free-run", 1.0, {}),
    ("closed_differential", "held-input-dry-load", 0.45, {"M_H2": 214.37247051489385}), ("closed_differential", "one-way-stop", 0.3, {}),
    ("closed_differential", "housing-drag", 0.3, {}), ("impulse_transmission", "fig2", 1.0, {}),
    ("impulse_transmission", "sticking", 1.0, {}), ("prosthetic_leg", "swing", 0.4, {}), ("prosthetic_leg", "stance-drop", 0.2, {}),
    ("gear_linkage", "constant-crank", 0.6, {}), ("planetary", None, 1.0, {}), ("class4_linkage", "driven-crank", 0.5, {}),
    ("quick_return", None, 1.0, {}), ("platform_3rrr", "free-run", 0.5, {}),
)  # fmt: skip


def compared(run: Recording, truth: Recording) -> Iterator[tuple[str, float, float]]:
    """Channel, stated error, true error."""
    mine, other = shared_times(run, truth)
    for name, values in run.channels.items():
        if name in truth.channels:
            yield name, run.errors[name], largest_difference(values[mine], truth.channels[name][other])


def sharp(design: Design, scene: str | None, duration: float | None) -> Recording:
    """The scene at SHARP; where that is not reached, by the entry's own equations if it has them."""
    found = ml.simulate(design, scene=scene, duration=duration, max_error=SHARP)
    if found.health.trusted or design.entry.reference is None:
        return found
    own = ml.simulate(design, scene=scene, duration=duration, engine="analytic")
    return replace(own, errors={n: OWN * float(np.max(np.abs(x))) for n, x in own.channels.items()})


def main(target: float = 1e-3, *names: str) -> None:
    """Print the table."""
    understated = channels = 0
    for name, scene, duration, parameters in SCENES:
        if names and name not in names:
            continue
        told = f"{name} {scene or ''} {duration or ''}"
        try:
            design = ml.load(name, **parameters)
            run = ml.simulate(design, scene=scene, duration=duration, max_error=target)
            truth = sharp(design, scene, duration)
        except MechlabError as why:
            print(f"{told}: {why}", flush=True)
            continue
        ways = [f"{x.settings.engine} {x.settings.integrator} exit {x.health.exit_code}" for x in (run, truth)]
        print(f"{told}: {ways[0]}; truth {ways[1]}")
        for channel, stated, true in compared(run, truth):
            own = truth.errors.get(channel, math.inf)
            ratio = stated / true if true > 0.0 else math.inf
            known = true - own > 0.0
            low = known and (true - own) > UNDERSTATED * stated
            channels, understated = channels + 1, understated + low
            size = float(np.max(np.abs(run.channels[channel])))
            print(
                f"    {channel:28s}{run.units.get(channel, ''):10s} stated {stated:9.2g} true {true:9.2g} (+- {own:8.2g}) "
                f"ratio {ratio:9.3g} size {size:8.3g}{'  UNDERSTATED' if low else '' if known else '  truth not known so well'}",
                flush=True,
            )
    print(f"{channels} channels, understated more than {UNDERSTATED:g} times: {understated}")


if __name__ == "__main__":
    main(*(float(x) for x in sys.argv[1:2]), *sys.argv[2:])
