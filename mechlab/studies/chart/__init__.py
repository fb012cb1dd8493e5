"""`chart`: speed against accuracy of every method on a scene."""
