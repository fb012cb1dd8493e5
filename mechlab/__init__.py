"""mechlab: a mechanism lab."""
