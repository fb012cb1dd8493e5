"""A sweep on a real Dask cluster of several processes, one of which is killed in the middle: the numbers are those of here."""

import os
import signal
import sys

import numpy as np
import pytest

import mechlab as ml
from mechlab.values import Range

distributed = pytest.importorskip("distributed")


pytestmark = [pytest.mark.slow, pytest.mark.machine]


@pytest.fixture(scope="module")
def cluster():
    """The scheduler serves HTTP even without a dashboard: at any free port, for 8787 may be taken."""
    processes = {"n_workers": 3, "threads_per_worker": 1, "processes": True}
    with distributed.LocalCluster(**processes, dashboard_address="127.0.0.1:0") as made:
        yield made


def test_another_dask_may_hold_its_usual_port(cluster) -> None:
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        services = client.scheduler_info()["services"]
    assert 8787 not in services.values()


def workers(cluster) -> dict[str, int]:
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        return client.run(os.getpid)


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL to send")
def test_a_killed_worker_loses_nothing_and_the_numbers_are_the_local_ones(cluster, tmp_path) -> None:
    file = tmp_path / "swing.py"
    file.write_text(
        "from mechlab.mechanism import Builder, revolute\n"
        "def swing(length=1.0):\n    b = Builder('swing')\n    b.bar('bar', revolute('hinge', 'y'), length, mass=2.0)\n"
        "    return b.build()\n"
    )
    asked = {"quantities": "hinge_accel,max(hinge_rate),energy_balance", "duration": 0.02}
    values = {"length": Range(-0.1, 1.5, 96)}  # the first ones are no lengths: gaps travel too
    here = ml.sweep(f"{file}:swing", values, workers=1, **asked)
    victims = workers(cluster)
    killed: list[int] = []

    def progress(done: int, total: int) -> None:
        if done >= total // 8 and not killed:
            killed.append(next(iter(victims.values())))
            os.kill(killed[0], signal.SIGKILL)

    there = ml.sweep(
        f"{file}:swing", values, scheduler=cluster.scheduler_address, out=tmp_path / "s.nc", progress=progress, **asked
    )
    assert killed and here.request.blocks == 96
    assert np.array_equal(here.flat, there.flat, equal_nan=True) and here.reasons == there.reasons
    assert there.counts["good"] == 90 and there.counts["bad_input"] == 6 and there.evaluated == 96


def test_closed_forms_and_rollouts_on_the_cluster_have_the_same_bits(cluster) -> None:
    fixed = {"z": 0.0, "alpha": 0.1, "beta": 0.0, "gamma": 0.0}
    for source, values, options in (
        ("delta6", {"x": Range(-0.1, 0.1, 200), "y": Range(-0.1, 0.1, 200)} | fixed, {}),
        (
            "pendulum",
            {"angle_0": Range(0.0, 3.0, 40), "angle_rate_0": Range(-1.0, 1.0, 40)},
            {"quantities": "angle,x", "duration": 0.05},
        ),
    ):
        here = ml.sweep(source, values, **options)
        there = ml.sweep(source, values, scheduler=cluster.scheduler_address, **options)
        assert here.request.blocks > 1
        assert np.array_equal(here.flat, there.flat, equal_nan=True) and here.reasons == there.reasons
