"""No more model than the scene needs: what each fidelity answers, how wrong it is, what it costs, and which one to take."""
