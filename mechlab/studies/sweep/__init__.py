"""Sweeps: many designs, initial states or questions at once, on all cores or on a cluster; one labelled dataset."""
