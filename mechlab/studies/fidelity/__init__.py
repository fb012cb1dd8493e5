"""`mechlab fidelity`: all fidelities of a scene side by side: answers, error against the richest, cost."""
