"""Other people's engines beside ours, fed from the same Mechanism: Exudyn, Drake, OpenSim on Simbody, MuJoCo Warp,
Newton's Kamino.

Only charts use them, to say what a result costs elsewhere. They are not witnesses. Each runs in a process of its own.
"""
