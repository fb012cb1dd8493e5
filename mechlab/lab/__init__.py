"""The core that asks and runs: designs, answers, runs, accuracy, fidelity."""
