"""Questions that are asked of no mechanism: of a curve or a linkage in a file, or of functions whose signs say what is inside."""

NAMES = ("toolpath", "bspline", "regions", "assur")
"""Names that `solve` and `show` take instead of a mechanism; the questions stand in `table`, which loads scipy."""
