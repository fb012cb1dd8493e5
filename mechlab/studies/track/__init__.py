"""A frame, joint or centre of mass of a closed mechanism follows a path: tasks with priorities, limits, a QP a step."""
