"""`mechlab doctor`: what is wrong, or will go wrong, with anybody's MJCF or URDF; and the settings to paste."""
