"""The terms that every world has, in the order in which they act at their hooks."""

from wavetank.physics.terms.dynamic_viscosity.implicit_viscosity import VISCOSITY, WARM_START
from wavetank.physics.terms.friction import FRICTION
from wavetank.physics.terms.tension import TENSION
from wavetank.physics.terms.term import Term
from wavetank.physics.terms.vorticity import VORTICITY
from wavetank.physics.terms.xsph import XSPH

TERMS: tuple[Term, ...] = (TENSION, VISCOSITY, WARM_START, FRICTION, XSPH, VORTICITY)
