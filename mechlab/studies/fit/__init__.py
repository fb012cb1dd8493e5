"""Parameters from measured series: least squares, confidence intervals, and what the data do not determine."""
