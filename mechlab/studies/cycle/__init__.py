"""`cycle`: one turn of the drive of a mechanism with one freedom."""
