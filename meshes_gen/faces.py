"""Faces cut out of a parametric head: Liu's with four expressions, Ho's with two."""

from __future__ import annotations

from cembench.core.arrays import Real

from .head import NEUTRAL, POUTING, SMILE, WRY, Expression, Head, Person, with_skin
from .implicit import Body, Field, ellipsoid

LIU = Person(jaw=1.0, nose=1.0, nose_width=1.0, lips=1.0, cheeks=1.0, skin_seed=11)
HO = Person(
    jaw=1.1, nose=0.85, nose_width=1.2, lips=1.1, eyes=0.8, brow=0.9, cheeks=1.15, skin_seed=23
)
EXPRESSIONS = {"neutral": NEUTRAL, "smile": SMILE, "pouting": POUTING, "wry": WRY}


def mask(p: Real) -> Real:
    """Return a field that is positive on the face: hairline to under the chin, back to the ears."""
    return -ellipsoid(p, (0, -0.62, -0.10), (0.92, 0.72, 1.12))


def face_body(person: Person, expression: Expression, seed: int = 0) -> Body:
    """A person's face with an expression, cut out of the head."""
    head = Head(person, expression, ears=False)
    f: Field = with_skin(head, person.skin_seed + seed)
    return Body(f, mask, (-0.95, -1.30, -1.60), (0.95, 0.35, 1.25), 170)
