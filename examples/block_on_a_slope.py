"""A block on a slope slides when the slope is steeper than the angle of friction, atan(mu).

The ground is tilted by turning gravity. With mu = 0.5 the limit is 26.565 degrees. (A cube topples at 45 degrees, so
sliding comes first.)
"""

import math

import cyclopean

block = cyclopean.stack(1, mu=0.5)  # one cube on a fixed slab

flat, steep = 0.0, 45.0  # stands, slides
while steep - flat > 1e-6:
    middle = (flat + steep) / 2
    result = cyclopean.check(block, cyclopean.Settings(tilt=(middle, 0.0)))
    flat, steep = (middle, steep) if result.verdict == "stable" else (flat, middle)

print(f"slides at {steep:.4f} degrees; atan(0.5) is {math.degrees(math.atan(0.5)):.4f}")
assert abs(steep - math.degrees(math.atan(0.5))) < 1e-4
