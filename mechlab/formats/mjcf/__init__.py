"""MJCF, the model files of MuJoCo: `write*` turn a Mechanism into text, `read*` turn text into a Mechanism."""
