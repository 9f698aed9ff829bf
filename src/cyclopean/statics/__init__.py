"""Statics of rigid blocks in contact: symbols, signs, scaling.

One symbol table; the same letter means the same thing everywhere.

    i, j      blocks; c_i centre of mass, V_i volume, rho_i density, D_i diagonal of the box around it
    w_i       own weight rho_i V_i |g| (of standard gravity where there is none): what a block's balance is measured by
    C         component: free blocks joined by contacts; W_C its weights and loads, w_C the least own weight in it
    k         contact point at r_k with right-handed frame (n, u, v), n from block `a` into block `b`
    f_k       (fn, fu, fv): the force on `b` is +(fn n + fu u + fv v), on `a` its opposite; fn >= 0 is compression
    f_t       (fu, fv), |f_t| its Euclidean norm
    mu        Coulomb coefficient; K_mu = {fn >= 0, |f_t| <= mu fn}, K_mu* = {dn >= mu |d_t|} its dual
    A         6 x (free blocks) by 3 x (points), rows Fx Fy Fz Mx My Mz of each free block, moments about c_i
    p         applied loads: weight and given forces, with their moments about c_i
    A f = -p  equilibrium
    y, dq     virtual velocity (vx vy vz wx wy wz) of each free block, of its centre of mass, world axes
    dd        A' y = (dn, du, dv): relative velocity of b to a at each point; dn > 0 opens
    D         3 x 3 positive semidefinite block of each point
    S         A D A', 6 x 6 blocks on the graph of free blocks

Fixed blocks have no rows. Scaling: forces by the mean weight of a free block, lengths by the mean of V^(1/3), so that
no verdict depends on units. (Kao et al. 2022 write A with the opposite sign.)
"""

from cyclopean.statics.cones import cone_jacobian, cone_regions, project_cones, pyramid_rows
from cyclopean.statics.equilibrium import (
    EquilibriumSystem,
    body_loads,
    contact_matrix,
    equilibrium_system,
    turned_gravity,
)
from cyclopean.statics.plane import PlaneSystem, plane_system
from cyclopean.statics.schur import Schur

__all__ = [
    "EquilibriumSystem",
    "PlaneSystem",
    "Schur",
    "body_loads",
    "cone_jacobian",
    "cone_regions",
    "contact_matrix",
    "equilibrium_system",
    "plane_system",
    "project_cones",
    "pyramid_rows",
    "turned_gravity",
]
