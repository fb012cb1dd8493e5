"""The choice of the fidelity: what each one answers, how large its error is, what it costs, and which one a scene
needs."""
