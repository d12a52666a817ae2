"""Check the folder of a paper before anything is measured for it."""

from __future__ import annotations

from pathlib import Path

from cembench.api.settings import AnyPath
from cembench.core.arguments import checked


@checked
def check_paper(folder: AnyPath) -> list[str]:
    """Check a paper's folder: names, expressions, models and digits, with files and lines.

    Nothing is measured. docs/papers.md says what the folder holds.

    Parameters
    ----------
    folder : path
        The folder of the paper, or the name of an installed one.

    Returns
    -------
    list of str
        What is wrong, a sentence each; empty if nothing is.

    Raises
    ------
    RegistryError
        There is no such paper.

    Examples
    --------
    >>> import cembench
    >>> cembench.check_paper("cem")
    []
    """
    from cembench.core.errors import RegistryError
    from cembench.registry import load_registry
    from cembench.report.content.paper_check import wrong_with
    from cembench.results.papers import find_paper

    try:
        paper = find_paper(str(folder))
    except RegistryError as error:
        if not Path(folder).is_dir():
            raise
        return [str(error)]
    return list(wrong_with(paper, load_registry()))
