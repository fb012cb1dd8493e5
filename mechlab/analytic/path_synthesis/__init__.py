"""Path synthesis: linkages whose coupler point passes through given points."""
