"""A named number of a design: a parameter, an answer, a channel, a check ...: one definition for all studies."""
