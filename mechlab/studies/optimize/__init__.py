"""The best parameters for a goal, by optimisers of scipy, over any quantity that mechlab computes; fronts of two goals."""
