"""The engines of the lab itself: one freedom (Eksergian), and hybrid (sticking, sliding, stops as events)."""
