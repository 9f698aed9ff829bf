"""A beam that hangs on nothing but friction: rigid-block equilibrium accepts it, coupled analysis proves it unstable.

A beam is held between the upright faces of two fixed columns, with nothing below it. Friction can carry it if the
columns squeeze it hard enough. Rigid-block equilibrium asks only whether *some* forces balance, so it answers stable,
even at mu = 0.01; but nothing in the model can produce that squeeze. Coupled analysis asks for a virtual displacement
that brings the forces about, and proves case by case that there is none. See "How to read a verdict" in the README.
"""

import numpy as np

import cyclopean

FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def cuboid(
    name: str, low: tuple[float, float, float], high: tuple[float, float, float], fixed: bool
) -> cyclopean.Block:
    """A block with sides along the axes."""
    (x, y, z), (X, Y, Z) = low, high
    corners = [(x, y, z), (X, y, z), (X, Y, z), (x, Y, z), (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)]
    return cyclopean.Block(name, np.array(corners), FACES, density=2400.0, fixed=fixed)


frame = cyclopean.Assembly(
    (
        cuboid("left", (0.0, 0.0, 0.0), (0.4, 0.4, 1.2), True),
        cuboid("right", (1.0, 0.0, 0.0), (1.4, 0.4, 1.2), True),
        cuboid("beam", (0.4, 0.0, 0.6), (1.0, 0.4, 0.9), False),
    )
)

# Equilibrium alone: by hand, each column must press with W / (2 mu).
rbe = cyclopean.check(frame, cyclopean.Settings(method="rbe", mu=0.01))
assert rbe.verdict == "stable"
assert rbe.force is not None
weight = 2400.0 * 0.6 * 0.4 * 0.3 * 9.80665
squeeze = float(rbe.force[rbe.contacts.patch == 0, 0].sum())
print(f"RBE, mu 0.01: {rbe.verdict}, if something squeezes the beam with {squeeze / weight:.0f} times its weight")
assert squeeze / weight > 49.9

# Forces together with a displacement: none, at ordinary friction either.
for mu in (0.01, 0.84):
    cra = cyclopean.check(frame, cyclopean.Settings(mu=mu))
    print(f"CRA, mu {mu:g}: {cra.verdict}. {cra.reason}")
    assert cra.verdict == "unstable"
    assert cra.certificate is not None
    assert cra.certificate["kind"] == "cra-tree"
    assert cyclopean.verify(cra.certificate).proved

# Without friction not even forces balance.
assert cyclopean.check(frame, cyclopean.Settings(mu=0.0, method="rbe")).verdict == "unstable"
