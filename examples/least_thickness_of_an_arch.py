"""How thin may a semicircular arch be? Milankovitch's answer, found by bisection.

An arch of 20 voussoirs, radius 1 m to its middle line, friction 0.84. Each voussoir is drawn with 32 chords, so that
its weight acts where that of a curved stone does. The textbook value for so many voussoirs is t/R = 0.1075.
"""

import cyclopean


def stands(thickness: float) -> bool:
    """Whether the arch of this thickness (m) is stable; every answer is proved."""
    result = cyclopean.check(cyclopean.arch(20, radius=1.0, thickness=thickness, facets=32))
    assert result.certificate is not None
    assert cyclopean.verify(result.certificate).proved
    return result.verdict == "stable"


thin, thick = 0.09, 0.13  # falls, stands
while thick - thin > 1e-4:
    middle = (thin + thick) / 2
    thin, thick = (thin, middle) if stands(middle) else (middle, thick)

print(f"least thickness: {thick:.4f} of the radius")
assert abs(thick - 0.1075) < 2e-4
