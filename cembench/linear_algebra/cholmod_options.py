"""The options of CHOLMOD, which cvxopt keeps in one dictionary for the whole process."""

from __future__ import annotations

from cvxopt import cholmod


def set_options(*, postorder: bool) -> None:
    """Set all options that matter, which is needed before each analysis and factorisation.

    ``supernodal = 2`` also makes an indefinite matrix an error; without ``nmethods = 1`` a given
    permutation may be ignored. With `postorder` the given order is changed to the postorder of its
    elimination tree, which mixes a disconnected leading block with the rows after it.
    """
    cholmod.options["supernodal"] = 2
    cholmod.options["nmethods"] = 1
    cholmod.options["print"] = 0
    cholmod.options["postorder"] = postorder
