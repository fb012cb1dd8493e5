"""The choice of the fidelity: what each one answers, its error, its cost, and which one a scene needs."""
