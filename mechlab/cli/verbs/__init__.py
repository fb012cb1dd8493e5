"""One module for each verb: what stands behind it, its options, and the one call of the API."""
