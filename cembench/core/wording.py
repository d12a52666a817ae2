"""Numbers of things in words."""


def counted(number: int, noun: str) -> str:
    """Return a number of things in words.

    >>> counted(1, "island"), counted(2500, "fold")
    ('1 island', '2,500 folds')
    """
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
