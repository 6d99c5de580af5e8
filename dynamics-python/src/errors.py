"""Exceptions of models. They cross processes: what cannot, the motion up to a failure, stays behind."""


class SimulationError(RuntimeError):
    """A run that ended before its end.

    partial: the motion up to there, or None where nothing was computed. It is not pickled.
    kind: the name of the failure, such as "StepSizeTooSmall".
    time: when it ended. step: the last step that was tried. state: the last good state.
    """

    partial = None
    kind = None
    time = None
    step = None
    state = None

    def __reduce__(self):
        kept = {name: value for name, value in self.__dict__.items() if name != "partial"}
        return (type(self), self.args, kept)


class StateError(ValueError):
    """A state that is not finite, or not on the constraints."""


class EvaluationError(RuntimeError):
    """A value that does not exist: a singular mass matrix, constraints without a common solution."""
