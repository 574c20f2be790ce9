"""Tension and twist of the fibres of a rod's section: a section under tension resists twist.

A fibre at the distance rho from the axis of twist becomes a helix. With the strains Gamma and K (`rod_strains`)
and the twist k without stress, to the second order in rho its strain is Gamma_1 + rho^2 q, q = K_1 (K_1 + 2 k)/2. What
this adds to the energy E A Gamma_1^2/2 per length is, with the means r2 and r4 of rho^2 and rho^4 over the section::

    E A (r2 Gamma_1 q + r4 q^2/2)

so that N = E A (Gamma_1 + r2 q) and the moment about x grows by E A (r2 Gamma_1 + r4 q)(K_1 + k). Over a step products
change by the means of their factors: forces of the means do the work of the change of the energy, exactly.

The damping of a rod is that of its linear stiffness alone.

Literature: Buckley 1914 (bifilar property of twisted strips); Wagner 1936 (torsion of sections under axial stress).
"""

from evolvent.compiled.jit import inlined, kernel
from evolvent.families.rods.rod_strains import STRAIN

USED_FOR = "rods"
_TWIST = STRAIN + 3


@inlined
def shortening(row, m):
    """Strain q of a fibre over rho^2 by the measures m of an element, 1/m2."""
    return 0.5 * m[_TWIST] * (m[_TWIST] + 2.0 * row.rest[3])


@inlined
def add_fibre_stress(row, m0, m1, scale, S):
    """Add scale times the force and the moment about x of an element's fibres over a step from measures m0 to m1."""
    if row.fibres[0] == 0.0:
        return
    q = 0.5 * (shortening(row, m0) + shortening(row, m1))
    along, turned = 0.5 * (m0[STRAIN] + m1[STRAIN]), 0.5 * (m0[_TWIST] + m1[_TWIST]) + row.rest[3]
    S[0] += scale * row.fibres[0] * q
    S[3] += scale * (row.fibres[0] * along + row.fibres[1] * q) * turned


@inlined
def fibre_energy(row, m):
    """Energy per length of an element's fibres beyond that of the strain of the axis, J/m."""
    q = shortening(row, m)
    return (row.fibres[0] * m[STRAIN] + 0.5 * row.fibres[1] * q) * q


@kernel
def add_fibre_tangent(row, m0, m1, D0, D1, A):
    """Add the length times D0^T (dS/dE) D1 to A : (7, 7), S as of `add_fibre_stress`; over a step twice that of m1."""
    if row.fibres[0] == 0.0:
        return
    q = 0.5 * (shortening(row, m0) + shortening(row, m1))
    along, turned = 0.5 * (m0[STRAIN] + m1[STRAIN]), 0.5 * (m0[_TWIST] + m1[_TWIST]) + row.rest[3]
    end, two, four = m1[_TWIST] + row.rest[3], row.length * row.fibres[0], row.length * row.fibres[1]
    by_twist = two * along + four * (q + end * turned)
    for i in range(7):
        for j in range(7):
            A[i, j] += two * (end * D0[0, i] * D1[3, j] + turned * D0[3, i] * D1[0, j]) + by_twist * D0[3, i] * D1[3, j]
