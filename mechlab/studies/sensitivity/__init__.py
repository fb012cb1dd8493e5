"""First-order sensitivity of answers to parameters, and the tolerances that follow from it."""
