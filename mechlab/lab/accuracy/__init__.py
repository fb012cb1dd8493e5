"""Error control: a scene is solved to a stated error, by one set of rules for all mechanisms."""
