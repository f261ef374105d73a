"""What a machine does not let us do."""


class CannotDoError(Exception):
    """The fault cannot be made here; its text says why."""
