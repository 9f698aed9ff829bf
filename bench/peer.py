"""Our rigid-block equilibrium against compas_cra 0.8.0 on the same contacts, in one run (extra `peer`).

Run `python bench/peer.py [courses ...]` (default 3 5 8 10 15 20); prints one row a wall: the peer's set-up and solve,
our contact detection, our set-up and solve, and our time to a verified verdict, all in seconds, medians of three runs
on our side and of one on the peer's.
"""

import contextlib
import io
import sys
from statistics import median
from time import perf_counter

import numpy as np
from compas.datastructures import Mesh
from compas.geometry import Frame
from compas_assembly.datastructures import Block as PeerBlock
from compas_cra.datastructures import CRA_Assembly
from compas_cra.equilibrium.cra_native import rbe_problem, solve_nlp
from contacts import wall

from cyclopean.analysis import Settings, check, solve_rbe
from cyclopean.arrays import Bools
from cyclopean.assembly import Assembly, Contacts, detect, supports
from cyclopean.statics import equilibrium_system

MU = 0.84


def peer_model(model: Assembly, contacts: Contacts, fixed: Bools | None = None) -> CRA_Assembly:
    """The same blocks, supports and contact polygons in the peer's data structure."""
    theirs = CRA_Assembly()
    held = supports(model)[0] if fixed is None else fixed
    for i, block in enumerate(model.blocks):
        mesh = Mesh.from_vertices_and_faces(block.vertices.tolist(), [list(face) for face in block.faces])
        theirs.add_block(mesh.copy(cls=PeerBlock), node=i)
        theirs.graph.node_attribute(i, "is_support", bool(held[i]))
    for k in range(len(contacts)):
        a, b = int(contacts.a[k]), int(contacts.b[k])
        if held[a] and held[b]:
            continue
        polygon = contacts.polygon(k)
        _, u, v = contacts.frame[k]
        frame = Frame(polygon[0].tolist(), u.tolist(), v.tolist())
        theirs.add_to_interfaces(a, b, float(contacts.area[k]), polygon.tolist(), frame)
    return theirs


def timed(work) -> tuple[float, object]:
    """Seconds and answer; what the peer prints on the way is dropped."""
    with contextlib.redirect_stdout(io.StringIO()):
        began = perf_counter()
        answer = work()
        return perf_counter() - began, answer


def ours(model: Assembly, contacts: Contacts) -> object:
    gravity = np.array([0.0, 0.0, -9.80665])
    return solve_rbe(equilibrium_system(model, contacts.with_mu(MU), supports(model)[0], gravity, 2400.0))


def main() -> None:
    check(wall(2, 2), Settings(method="rbe"))  # imports are not what is timed
    print(f"{'wall':>8} {'contacts':>8} {'peer set-up':>11} {'solve':>7} |", end="")
    print(f" {'detect':>7} {'set-up+solve':>12} {'whole':>7} {'ratio':>6}")
    for side in [int(s) for s in sys.argv[1:]] or [3, 5, 8, 10, 15, 20]:
        model = wall(side, side)
        found = detect(model).contacts
        theirs = peer_model(model, found)
        prepare, problem = timed(lambda theirs=theirs: rbe_problem(theirs, mu=MU, density=1.0))
        optimise, _ = timed(lambda problem=problem: solve_nlp(problem[0], backend="native", verbose=False))
        detecting = median(timed(lambda model=model: detect(model))[0] for _ in range(3))
        solving = median(timed(lambda model=model, found=found: ours(model, found))[0] for _ in range(3))
        whole = median(timed(lambda model=model: check(model, Settings(method="rbe", mu=MU)))[0] for _ in range(3))
        print(
            f"{side:>3} x {side:<2} {len(found):>8} {prepare:>11.2f} {optimise:>7.2f} |"
            f" {detecting:>7.3f} {solving:>12.3f} {whole:>7.3f} {(prepare + optimise) / solving:>6.0f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
