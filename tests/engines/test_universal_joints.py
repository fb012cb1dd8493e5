"""Cardan joints: pins between bodies that only turn about their centres of mass, and rows that repeat others where they are closed.

MuJoCo 4.0.0 scales the softness of a pin by how easily the centres of mass move (here: not at all), and leaves out a connect that no
joint moves; Pinocchio's equations meet rows that repeat each other up to (rate x step)^2 in the middle of a step.
"""

import math

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.experiment.scene import Scene, Settings
from mechlab.formats.mjcf.read import from_mjcf
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute

BEND, SPEED, TIME = 0.6, 6.0, 0.4
ROD, CROSS, OUT = (Inertia.axial(0.1, x, 2.0 * x) for x in (3e-6, 5e-6, 8e-6))
"""Driver, cross, follower, their centres of mass in the middle of the joint."""


def cardan() -> Mechanism:
    """Input along x, output in the plane x-y."""
    c, s = math.cos(BEND), math.sin(BEND)
    b = Builder("cardan", gravity=(0.0, 0.0, 0.0))
    b.body("driver", revolute("driver", "x"), inertia=ROD)
    b.body("cross", revolute("cross", "z"), parent="driver", inertia=CROSS)
    b.body("follower", revolute("follower", (c, s, 0.0)), inertia=Inertia.axial(0.1, 8e-6, 8e-6))
    b.loop("pin", "cross", "follower", kind="revolute", axis_a=(-s, c, 0.0))
    return b.build()


def double_cardan() -> Mechanism:
    """Two bends in one plane: six hinges, one of five rows repeats others."""
    c, s, half = math.cos(BEND), math.sin(BEND), 0.05
    b = Builder("double_cardan", gravity=(0.0, 0.0, 0.0))
    b.body("driver", revolute("driver", (c, s, 0.0)), at=(-half, 0, 0), inertia=ROD)
    b.body("cross_1", revolute("cross_1", (-s, c, 0.0)), parent="driver", inertia=CROSS)
    b.body(
        "middle", revolute("middle", "z"), parent="cross_1", inertia=Inertia.rod(0.1, (0, 0, 0), (2 * half, 0, 0), 0.01)
    )
    b.body("follower", revolute("follower", (c, -s, 0.0)), at=(half, 0, 0), inertia=OUT)
    b.body("cross_2", revolute("cross_2", (s, c, 0.0)), parent="follower", inertia=CROSS)
    b.loop("pin", "cross_2", "middle", (0, 0, 0), (2 * half, 0, 0), kind="revolute", axis_a="z")
    return b.build()


def energy_angle(angle: np.ndarray) -> np.ndarray:
    """Kinetic energy over half the square of the driver's rate, from the velocities of cross and follower in closed form.

    tan f = cos(bend) tan t, cross turn k about its yoke: the pin of the follower, (-s cos f, c cos f, sin f), lies in the cross.
    """
    c, s, t = math.cos(BEND), math.sin(BEND), angle
    f_rate = c / (np.cos(t) ** 2 + (c * np.sin(t)) ** 2)
    # angular velocity of the cross = that of the follower plus a turn about its pin = (1, 0, 0) t' plus a turn about the yoke pin
    yoke = np.array([0 * t, -np.sin(t), np.cos(t)])
    out = np.array([c, s, 0.0])[:, None] * f_rate
    # w = e_x + a yoke = out + b pin; yoke and pin are at right angles
    a = np.sum(yoke * (out - np.array([[1.0], [0.0], [0.0]])), axis=0)
    w = np.array([1.0 + 0 * t, 0 * t, 0 * t]) + a * yoke
    along = CROSS.tensor[2], CROSS.tensor[0]
    # the cross is a body of revolution about its own z, which is the yoke pin
    spin = np.sum(w * yoke, axis=0)
    cross = along[1] * (np.sum(w * w, axis=0) - spin**2) + along[0] * spin**2
    return ROD.tensor[0] + cross + 8e-6 * f_rate**2


@pytest.mark.parametrize("name, h", [("mujoco", 1e-3), ("mujoco", 2e-4), ("pinocchio", 1e-3)])
def test_a_free_cardan_joint_follows_its_energy(name: str, h: float) -> None:
    m = cardan()
    scene = Scene("free", "full", TIME, (), {"driver": 0.0}, {"driver": SPEED})
    run = engine(name).run(m, scene, Settings(name, timestep=h), [TIME])
    # the energy is constant: t' = speed sqrt(J(0) / J(t)); time of the angle by quadrature
    angle = np.linspace(0.0, float(run.channels["driver"][-1]), 20001)
    slowness = np.sqrt(energy_angle(angle) / energy_angle(np.zeros(1))) / SPEED
    time = float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(angle)))
    # RK4 with rows soft to (2 h)^2 x acceleration: 1e-4 relative at 1 ms
    assert time == pytest.approx(TIME, rel=2e-4 if name == "mujoco" else 1e-7)
    ratio = run.channels["follower_rate"][-1] / run.channels["driver_rate"][-1]
    t = run.channels["driver"][-1]
    assert ratio == pytest.approx(math.cos(BEND) / (math.cos(t) ** 2 + (math.cos(BEND) * math.sin(t)) ** 2), rel=1e-3)


@pytest.mark.parametrize("name", ["mujoco", "pinocchio"])
def test_a_double_cardan_joint_turns_evenly_and_keeps_its_energy(name: str) -> None:
    m = double_cardan()
    scene = Scene("free", "full", TIME, (), {"driver": 0.0}, {"driver": SPEED})
    run = engine(name).run(m, scene, Settings(name, timestep=1e-3), [0.5 * TIME, TIME])
    # mirror symmetry about the middle shaft: follower = driver at all times
    assert run.channels["follower"] == pytest.approx(run.channels["driver"], abs=2e-5)
    energy = [0.5 * v @ engine("numpy").state(m, q, v).mass_matrix @ v for q, v in zip(run.q, run.v, strict=True)]
    assert energy[-1] == pytest.approx(energy[0], rel=1e-5)
    assert run.channels["driver"][-1] > 0.5 * SPEED * TIME


def test_pins_between_still_masses_are_scaled_by_a_body_off_their_axis() -> None:
    """MuJoCo's inverse weight of a body is the mean over the axes of J M^-1 J^T at its centre of mass, here the pin's second end p."""
    model = mujoco.MjModel.from_xml_string(to_mjcf(cardan()))
    x, y, _ = model.site_pos[model.site("pin:axis_a").id]
    about_x, about_z = ROD.tensor[0] + CROSS.tensor[0], CROSS.tensor[2]  # of the driver's turn, and of the cross's
    mean = ((x * x + y * y) / about_z + y * y / about_x) / 3.0
    assert model.body_invweight0[model.body("pin:holder").id, 0] == pytest.approx(mean, rel=1e-9)
    assert model.body_mass.sum() == pytest.approx(0.3, rel=1e-12)
    assert ":holder" not in to_mjcf(ml.load("fourbar").mechanism())
    assert [b.name for b in from_mjcf(to_mjcf(cardan())).bodies] == [b.name for b in cardan().bodies]


def test_a_pin_passes_an_axis_of_the_world_in_the_middle_of_a_step_or_at_its_end() -> None:
    """After a quarter turn, at a step, the pin of the follower lies along z, and the row of its second end along z is 0."""
    run = ml.simulate("cardan")
    t, bend = run.channels["driver_angle"], ml.load("cardan").parameters.angle
    ratio = math.cos(bend) / (np.cos(t) ** 2 + (math.cos(bend) * np.sin(t)) ** 2)
    assert run.settings.engine == "mujoco" and np.min(np.abs(t - 0.5 * np.pi)) < 1e-6
    # Hooke's law; rows soft to (4 h)^2 x acceleration, 1e-4, of which the driver's even turn leaves less
    assert run.channels["follower_angle_rate"] == pytest.approx(ratio * run.channels["driver_angle_rate"], rel=1e-4)
    assert run.health.trusted


def hooke(bend: float, pins: tuple[object, object]) -> Mechanism:
    """Two shafts in the plane x-y that meet at the origin under an angle, joined by one loop with these pins."""
    b = Builder("hooke")
    second = (math.cos(bend), math.sin(bend), 0.0)
    b.body("input", revolute("turn_in", "x"), inertia=Inertia.axial(1.0, 0.02, 0.02))
    b.body("output", revolute("turn_out", second), inertia=Inertia.axial(1.0, 0.02, 0.02))
    b.loop("cross", "input", "output", kind="universal", axis_a=pins[0], axis_b=pins[1])  # type: ignore[arg-type]
    return b.build()


@pytest.mark.parametrize("bend", [0.2, 0.7, 1.1])
@pytest.mark.parametrize("turn", [-2.0, 0.4, 1.3, 2.6])
def test_the_pins_of_a_universal_loop_are_the_axes_given(bend: float, turn: float) -> None:
    """Cardan's law. With the pin of the input in the plane of the shafts at 0, tan(in) = tan(out) cos(bend); with that of the output in
    it, tan(out) = tan(in) cos(bend). The rates follow by differentiation. The loop closes to 1e-12, whence 1e-10."""
    c, square = math.cos(bend), math.cos(turn) ** 2
    for pins, out, rate in (
        (("y", "z"), math.atan2(math.sin(turn), math.cos(turn) * c), c / (1.0 - square * math.sin(bend) ** 2)),
        (("z", (-math.sin(bend), c, 0.0)), math.atan2(math.sin(turn) * c, math.cos(turn)), c / (square + (1.0 - square) * c * c)),
    ):  # fmt: skip
        found = ml.solve(hooke(bend, pins), turn_in=turn, turn_in_rate=1.5)
        for witness in ("pinocchio", "mujoco"):
            assert found[witness]["turn_out"] == pytest.approx(out, abs=1e-10)
            assert found[witness]["turn_out_rate"] == pytest.approx(1.5 * rate, abs=1e-10)


def test_pins_that_make_no_cross_are_refused() -> None:
    with pytest.raises(ml.MechlabError, match="cross.x_y is open by 1 "):
        hooke(0.3, ("y", "y"))
    with pytest.raises(ml.MechlabError, match="two pins.*axis_a alone is given. Give axis_b too"):
        hooke(0.3, ("y", None))
    with pytest.raises(ml.MechlabError, match="two pins.*axis_b alone is given. Give axis_a too"):
        hooke(0.3, (None, "y"))
