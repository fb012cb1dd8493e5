"""What is asked and what comes back: scenes, laws, settings, recordings, health, questions, checks, claims. No engine."""
