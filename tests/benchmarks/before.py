"""Numbers of an older build, for the last column of the table of benchmarks: (section, name of the row) -> the number with its unit,
or the ratio to the same reference.

CPU seconds on two shared cores under load, in runs of their own: right within a factor of 1.5; ratios are of one run.
"""

DATE = "2026-11-22"

BEFORE: dict[tuple[str, str], str] = {
    ("recording", "n_fourbar fall: integration"): "ratio 1.3",
    ("recording", "n_fourbar fall: simulate"): "ratio 21",
    ("recording", "fourbar free-run: integration"): "ratio 1.8",
    ("recording", "fourbar free-run: simulate"): "ratio 21",
    ("recording", "closed_differential: integration"): "ratio 1.7",
    ("recording", "closed_differential: simulate"): "ratio 50",
    ("recording", "delta6 gravity-hold: integration"): "ratio 3.8",
    ("recording", "delta6 gravity-hold: simulate"): "ratio 55",
    ("recording", "pendulum: max_error 1e-06"): "0.071 s",
    ("recording", "n_fourbar: max_error 1e-06"): "0.37 s",
    ("recording", "n_fourbar N=20: max_error 1e-06"): "2.28 s",
    ("recording", "fourbar driven-crank: max_error 0.001"): "4.5 s",
    # whole runs; ranges at their middle
    ("peers", "pendulum to 1e-03 m"): "0.071 s",
    ("peers", "n_fourbar to 1e-03 m"): "0.37 s",
    ("peers", "n_fourbar to 1e-06 m"): "0.40 s",
    ("peers", "andrews to 1e-03 m"): "0.45 s",
    ("peers", "andrews to 1e-06 m"): "0.43 s",
    ("peers", "bricard to 1e-03 m"): "0.35 s",
    ("peers", "bricard to 1e-06 m"): "0.28 s",
    ("peers", "slider_crank to 1e-03 m"): "0.23 s",
    ("peers", "slider_crank to 1e-06 m"): "0.21 s",
    ("linkages", "four-bar, with rates and accelerations"): "0.43 to 0.57 us",
    ("closer", "solve fourbar: array of 360"): "16,500 us",
    ("verbs", "import mechlab"): "0.04 s",
    ("verbs", "--help"): "0.07 s",
    ("verbs", "list"): "2.2 s",
    ("verbs", "show fourbar"): "1.4 s",
    ("verbs", "solve fourbar crank_angle=1.2"): "1.75 s",
    ("verbs", "run delta6 -o OUT"): "18.5 s",
    ("verbs", "claims"): "48 s",
}
