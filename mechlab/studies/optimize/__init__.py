"""The best parameters for a goal: kept optimisers (scipy) over any quantity that mechlab can compute; fronts of two goals."""
