"""Engine `file`: MuJoCo runs a model file as it is, with its contacts, actuators, options and softness."""
