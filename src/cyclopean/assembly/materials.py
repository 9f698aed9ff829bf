"""Friction between two materials, and where it applies."""

from dataclasses import replace

import numpy as np

from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts

__all__ = ["paired_friction"]


def paired_friction(assembly: Assembly, contacts: Contacts) -> tuple[Contacts, tuple[str, ...]]:
    """Fill in the friction of contacts that give none from the materials of their blocks.

    Parameters
    ----------
    assembly : Assembly
        Blocks with their materials, and the friction of pairs of these.
    contacts : Contacts
        Those of the model, given or detected; what gives its own mu keeps it.

    Returns
    -------
    contacts : Contacts
        With mu where a pair says it.
    warnings : tuple of str
        One line on pairs of materials that touch and of which nothing is said.
    """
    if not assembly.friction or not len(contacts):
        return contacts, ()
    known = {frozenset((one.a, one.b)): one.mu for one in assembly.friction}
    material = [block.material for block in assembly.blocks]
    mu, unsaid = contacts.mu.copy(), set()
    for k in np.flatnonzero(np.isnan(contacts.mu)).tolist():
        a, b = material[contacts.a[k]], material[contacts.b[k]]
        if a is None or b is None:
            continue
        if (found := known.get(frozenset((a, b)))) is not None:
            mu[k] = found
        else:
            unsaid.add((min(a, b), max(a, b)))
    listed = ", ".join(f"{a} on {b}" for a, b in sorted(unsaid)[:3]) + (", ..." if len(unsaid) > 3 else "")
    said = f'"friction" says nothing of {len(unsaid)} pair(s) of materials that touch: {listed}'
    return replace(contacts, mu=mu), (said,) if unsaid else ()
