"""Questions across runs, one folder a verb: charts, cycles, checks, claims, modes, stability, sweeps, optimization."""
