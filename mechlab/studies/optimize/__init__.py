"""The best parameters for a goal, by optimizers of scipy, over any quantity that mechlab computes; fronts of two goals."""
