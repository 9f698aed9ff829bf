"""An inventory of the size wanted out of a few real stones: stretched, turned and scaled at random."""

from collections.abc import Sequence

import numpy as np

from cyclopean.design.stones.quarry import VOLUME
from cyclopean.design.stones.stone import Stone, in_body_frame, stone_of

STRETCH = (0.8, 1.2)


def stand_in(
    stones: Sequence[Stone], count: int, seed: int = 0, volume: tuple[float, float] = VOLUME
) -> tuple[Stone, ...]:
    """Each is one of the given stones, stretched by 0.8 to 1.2 along three random directions at right angles.

    Volumes (m3) are log-uniform. The order of the stones and their frames do not count; another seed, other stones.
    """
    models = sorted(stones, key=lambda s: (s.volume, s.area, s.hull_volume))
    found = []
    for k in range(count):
        draw = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, k))))
        size = float(np.clip(volume[0] * (volume[1] / volume[0]) ** draw.uniform(), *volume))
        model = models[int(draw.integers(len(models)))]
        axes, stretch = rotation(draw), draw.uniform(*STRETCH, 3)
        body = (in_body_frame(model) @ axes.T * stretch) @ axes @ rotation(draw).T
        body = body * (size / float(model.volume * stretch.prod())) ** (1.0 / 3.0)
        found.append(stone_of(f"stone-{k + 1:04d}", body, model.triangles, model.density))
    return tuple(found)


def rotation(draw: np.random.Generator) -> np.ndarray:
    """A rotation matrix, all equally likely: of a unit quaternion (Shoemake 1992)."""
    w, x, y, z = draw.normal(size=4)
    n = 2.0 / (w * w + x * x + y * y + z * z)
    return np.array(
        [
            [1.0 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)],
            [n * (x * y + w * z), 1.0 - n * (x * x + z * z), n * (y * z - w * x)],
            [n * (x * z - w * y), n * (y * z + w * x), 1.0 - n * (x * x + y * y)],
        ]
    )
