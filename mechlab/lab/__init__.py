"""The core of mechlab: designs, answers to questions, runs, accuracy, fidelity."""
