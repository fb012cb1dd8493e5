"""Questions that every train of gears answers: its power flow, and how far soft gear rows lag under load."""
