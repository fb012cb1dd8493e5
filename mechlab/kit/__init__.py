"""What catalog entries share: planar linkages, epicyclic trains, parts of benchmarks, witnesses of mass."""
