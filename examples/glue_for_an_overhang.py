"""How much glue would a block need that stands out too far?

A 1 m cube stands out 0.6 m over the one below. Its weight W acts 0.1 m beyond the edge, so it tips. The penalty form
of the analysis lets joints pull at a price, and so shows where and how much tension a state of equilibrium needs.
By hand: about the edge, tension at the back (0.4 m away) holds the weight at 0.1 m, so it is W / 4 in all.
"""

import cyclopean

model = cyclopean.stack(2, offset=0.6, density=2400.0)
result = cyclopean.check(model, cyclopean.Settings(penalty=True))
assert result.verdict == "unstable"  # the verdict is that of the dry joint
assert result.tension is not None

weight = 2400.0 * 9.80665
worst = int(result.tension.argmax())
where = result.contacts.point[worst]
joint = result.contacts.patch[worst]
pair = " and ".join(model.blocks[k].id for k in (result.contacts.a[joint], result.contacts.b[joint]))
print(f"tension {result.tension.sum():.0f} N in all, a quarter of the weight is {weight / 4:.0f} N")
print(f"largest at x = {where[0]:.2f} m, between {pair}")
assert pair == "b01 and b02"
assert abs(float(result.tension.sum()) / (weight / 4) - 1.0) < 1e-4
assert where[0] == 0.6  # the back edge of the joint
