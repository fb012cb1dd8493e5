"""Models for the doctor: a four-bar, a planetary train and an arm, healthy ones, with places for what is wrong."""

import numpy as np

HARD = 'solref="0.002 1" solimp=".9999 .9999 .001 .5 2"'
OPTION = '<option timestep="0.001" integrator="RK4" jacobian="dense"><flag autoreset="disable"/></option>'
NO_CONTACT = '<default><geom contype="0" conaffinity="0"/></default>'
# Crank 0.1, coupler 0.3, rocker 0.25, ground 0.3 at the crank angle 90 deg: coupler and rocker meet where both circles do.
RIGHT = np.array([0.3, 0.0])
_far = RIGHT - (0.0, 0.1)
_along = (0.3**2 - 0.25**2 + _far @ _far) / (2 * np.linalg.norm(_far))
_unit = _far / np.linalg.norm(_far)
PIN = np.array([0, 0.1]) + _along * _unit + np.sqrt(0.3**2 - _along**2) * np.array([-_unit[1], _unit[0]])


def bar(name: str, start: np.ndarray, end: np.ndarray, at: np.ndarray, inside: str = "", joint: str = "") -> str:
    """A bar that turns about -y, drawn in world axes in its reference pose."""
    d = end - start
    tip = f"{d[0]:.17g} 0 {d[1]:.17g}"
    place = start - at
    return (
        f'<body name="{name}" pos="{place[0]:.17g} 0 {place[1]:.17g}"><joint name="{name}" axis="0 -1 0" {joint}/>'
        f'<geom type="capsule" size="0.005" fromto="0 0 0 {tip}" density="1000"/><site name="{name}_end" pos="{tip}"/>{inside}</body>'
    )


def fourbar(
    option: str = OPTION, equality: str = HARD, defaults: str = NO_CONTACT, compiler: str = '<compiler angle="radian"/>',
    crank: str = "", rest: str = "", shift: float = 0.0, rocker: str = "", equal: str = "",
) -> str:  # fmt: skip
    zero, joint = np.zeros(2), np.array([0.0, 0.1])
    inner = bar("coupler", joint, PIN, zero)
    pin = PIN + (shift, 0.0)
    equal = equal or f'<connect name="pin" site1="coupler_end" site2="rocker_end" {equality}/>'
    return (
        f'<mujoco model="fourbar">{compiler}{option}{defaults}<worldbody><body name="base">'
        f"{bar('crank', zero, joint, zero, inner, crank)}{bar('rocker', RIGHT, pin, zero, '', rocker)}</body></worldbody>"
        f"<equality>{equal}</equality>{rest}</mujoco>"
    )


def planetary(ratio: str = "-2", tendon: str = "") -> str:
    """Sun, carrier, two planets on the carrier and a fixed ring; the second planet repeats the first."""

    def planet(k: int) -> str:
        inertia = '<inertial pos="0 0 0" mass="0.1" diaginertia="1e-5 1e-5 2e-5"/>'
        return (
            f'<body name="planet{k}" pos="{0.1 * (-1) ** k} 0 0"><joint name="planet{k}" axis="0 0 1"/>{inertia}</body>'
        )

    # Ring 40, planet 10, sun 20 teeth: planet = -3 carrier at the fixed ring (40 - 10 = 30 over 10), sun = 3 carrier.
    rows = "".join(
        f'<tendon name="ring{k}" tendon1="ring{k}" {HARD}/><tendon name="sun{k}" tendon1="sun{k}" {HARD}/>'
        for k in (1, 2)
    )
    meshes = "".join(
        f'<fixed name="ring{k}"><joint joint="planet{k}" coef="10"/><joint joint="carrier" coef="-30"/></fixed>'
        f'<fixed name="sun{k}"><joint joint="sun" coef="{20 if k == 1 else ratio}"/><joint joint="carrier" coef="-60"/></fixed>'
        for k in (1, 2)
    )
    return (
        f'<mujoco><compiler angle="radian"/>{OPTION}<worldbody><body name="base">'
        '<body name="sun"><joint name="sun" axis="0 0 1"/><inertial pos="0 0 0" mass="0.2" diaginertia="1e-5 1e-5 2e-5"/></body>'
        '<body name="carrier"><joint name="carrier" axis="0 0 1"/><inertial pos="0 0 0" mass="0.3" diaginertia="1e-4 1e-4 2e-4"/>'
        f"{planet(1)}{planet(2)}</body></body></worldbody><tendon>{meshes}{tendon}</tendon><equality>{rows}</equality></mujoco>"
    )


LINK = '<link name="{}"><inertial><mass value="{}"/><inertia ixx="{}" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
JOINT = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><axis xyz="0 0 1"/>'
    '<limit lower="{4}" upper="1" effort="1" velocity="1"/>{5}</joint>'
)


def arm(kind: str = "revolute", mass: float = 1.0, ixx: float = 0.01, lower: float = -1.0, extra: str = "") -> str:
    return (
        f'<robot name="arm"><link name="world"/>{LINK.format("upper", 1.0, 0.01)}{LINK.format("fore", mass, ixx)}'
        f"{JOINT.format('shoulder', 'revolute', 'world', 'upper', -1, '')}"
        f"{JOINT.format('elbow', kind, 'upper', 'fore', lower, extra)}</robot>"
    )
