"""Questions that every train of gears answers: its power flow, and how far soft gear rows lag under load."""

FORCE, RATE, ETA = "_force", "_rate", "efficiency"
ROW_SOFTNESS: dict[str, float | None] = {"row_timeconst": 2e-3, "row_impedance": 0.9999}
"""Time constant [s] and impedance of the rows (MuJoCo's solref and solimp); defaults: of the preset `accurate`."""


def asks_lag(keys: set[str]) -> bool:
    """True when the keys say how soft rows are."""
    return bool(keys & set(ROW_SOFTNESS))


def asks_power_flow(keys: set[str]) -> bool:
    """True when the keys ask for torques or efficiencies."""
    return any(k.endswith((FORCE, f"_{ETA}")) or k == ETA for k in keys)
