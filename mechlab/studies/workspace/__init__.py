"""Workspaces: where a mechanism can be, counted on a grid, with margins, maps, surfaces and comparisons."""
