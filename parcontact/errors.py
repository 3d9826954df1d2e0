"""What a user can put right."""


class InputError(Exception):
    """Bad input, said in one sentence: the program ends with exit code 2 and writes nothing."""


class RunError(Exception):
    """A run that cannot go on, said in one sentence: exit code 1."""
