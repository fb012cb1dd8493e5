"""Questions across runs: designs, answers from all witnesses, checks, claims, files, the whole pipeline."""
