"""Sparse LU of dense blocks along an elimination order, against dense LU."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose
from scipy.sparse.linalg import splu

from evolvent.algebra import dissection, ordering, sparse, sparse_lu
from evolvent.algebra.ordering import Pattern
from evolvent.algebra.sparse import SparseBlocks
from evolvent.solvers.static.work import sparse_of

Array = np.ndarray
GROUND = -1


def fill(matrix: SparseBlocks, A: Array) -> None:
    """Add all entries of a dense matrix."""
    for i, j in zip(*np.nonzero(A), strict=True):
        sparse.add_entry(matrix, i, j, A[i, j])
    assert matrix.counts[sparse.OUTSIDE] == 0


def pattern_of(sizes: list[int], pairs: list[tuple[int, int]]) -> Pattern:
    """Blocks without multipliers."""
    ends = np.cumsum([0, *sizes])
    blocks = [np.arange(a, b) for a, b in itertools.pairwise(ends)]
    some = np.zeros(len(sizes), dtype=bool)
    return Pattern(blocks, some, np.array(pairs, dtype=np.int64).reshape(-1, 2), some)


def mechanism(joints: list[tuple[int, int, int]], *, sizes: list[int], springs: list[tuple[int, int]] = ()) -> Pattern:
    """Bodies of given sizes, and joints (first body or the ground, second body, constraints)."""
    pattern = pattern_of([*sizes, *(joint[2] for joint in joints)], [])
    pairs = [*springs]
    for k, (a, b, _) in enumerate(joints):
        pairs += [(len(sizes) + k, body) for body in (a, b) if body != GROUND]
    multipliers = np.arange(len(pattern.blocks)) >= len(sizes)
    return pattern._replace(multipliers=multipliers, pairs=np.array(pairs, dtype=np.int64).reshape(-1, 2))


def chain(n: int, *, rows: int = 5, size: int = 6) -> Pattern:
    """Bodies in a row, the first on the ground."""
    return mechanism([(k - 1, k, rows) for k in range(n)], sizes=[size] * n)


def star(n: int) -> Pattern:
    """Arms of two bodies each around a body that floats."""
    joints = [(0, 1 + 2 * k, 5) for k in range(n)] + [(1 + 2 * k, 2 + 2 * k, 5) for k in range(n)]
    return mechanism(joints, sizes=[6] * (2 * n + 1))


def frame(n: int) -> Pattern:
    """Two legs of n nodes on the ground, joined by a body, and a lumped body at each node."""
    springs = [(leg * n + k, leg * n + k + 1) for leg in range(2) for k in range(n - 1)]
    joints = [(GROUND, leg * n, 6) for leg in range(2)] + [(leg * n + n - 1, 2 * n, 6) for leg in range(2)]
    joints += [(k, 2 * n + 1 + k, 6) for k in range(2 * n)]
    return mechanism(joints, sizes=[6] * (4 * n + 1), springs=springs)


def four_bars(n: int) -> Pattern:
    """Loops side by side: n + 1 rods on the ground (0 ... n), n rods between their ends."""
    joints = [(GROUND, k, 5) for k in range(n + 1)]
    joints += [(k, n + 1 + k, 4) for k in range(n)] + [(n + 1 + k, k + 1, 3) for k in range(n)]
    return mechanism(joints, sizes=[6] * (2 * n + 1))


def random_matrix(rng: np.random.Generator, pattern: Pattern, *, mass: float = 1.0) -> Array:
    """Positive definite, slightly unsymmetric blocks of bodies and springs, and constraints as a saddle point."""
    n = sum(block.size for block in pattern.blocks)
    A, size = np.zeros((n, n)), len(pattern.blocks)
    for b in np.flatnonzero(~pattern.multipliers):
        own = np.ix_(pattern.blocks[b], pattern.blocks[b])
        root = rng.standard_normal((pattern.blocks[b].size,) * 2)
        A[own] += mass * (root @ root.T + np.eye(len(root)))
    for a, b in pattern.pairs:
        if pattern.multipliers[a] != pattern.multipliers[b]:
            G = rng.standard_normal((pattern.blocks[a].size, pattern.blocks[b].size))
            A[np.ix_(pattern.blocks[a], pattern.blocks[b])] = G
            A[np.ix_(pattern.blocks[b], pattern.blocks[a])] = G.T
        else:
            both = np.concatenate([pattern.blocks[a], pattern.blocks[b]])
            root = rng.standard_normal((both.size, both.size))
            A[np.ix_(both, both)] += root @ root.T
            A[np.ix_(pattern.blocks[a], pattern.blocks[b])] += 0.1 * rng.standard_normal(
                (pattern.blocks[a].size, pattern.blocks[b].size)
            )
    assert size == len(pattern.multipliers)
    return A


def assert_solves(pattern: Pattern, A: Array, rng: np.random.Generator, *, spare: int = 0) -> SparseBlocks:
    """The solution is that of dense LU, to the condition of the matrix."""
    matrix = ordering.matrix_of(pattern, spare=spare)
    fill(matrix, A)
    assert_allclose(sparse_of(matrix).toarray(), A, rtol=0.0, atol=0.0)
    X = rng.standard_normal((2, len(A)))
    expected = np.linalg.solve(A, X.T).T
    assert sparse_lu.factor(matrix) == 0
    for row in X:
        sparse_lu.solve(matrix, row)
    assert_allclose(X, expected, rtol=0.0, atol=1e-11 * np.linalg.cond(A) * np.abs(expected).max())
    return matrix


def sheet(n: int) -> Pattern:
    """Nodes of n x n elements with four nodes each."""
    node = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    elements = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    pairs = sorted({pair for own in elements.tolist() for pair in itertools.combinations(sorted(own), 2)})
    return pattern_of([6] * node.size, pairs)


# ---------------------------------------------------------------------------------------------- solutions


@given(
    sizes=st.lists(st.sampled_from([1, 2, 3, 5, 6, 7, 12]), min_size=1, max_size=8),
    density=st.floats(0.0, 1.0),
    seed=st.integers(0, 10_000),
)
def test_solution_of_random_graphs(sizes: list[int], density: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = len(sizes)
    pairs = [(a, b) for a in range(n) for b in range(a + 1, n) if rng.random() < density]
    pattern = pattern_of(sizes, pairs)
    A = random_matrix(rng, pattern)
    for block in pattern.blocks:  # rows in disorder, so that pivots must be looked for
        A[block] = A[rng.permutation(block)]
    assert_solves(pattern, A, rng)


@pytest.mark.parametrize(
    "pattern",
    [
        pytest.param(chain(12), id="chain"),
        pytest.param(chain(5, rows=1, size=3), id="chain-of-points"),
        pytest.param(star(5), id="star"),
        pytest.param(frame(6), id="frame"),
        pytest.param(four_bars(5), id="four-bars"),
        pytest.param(mechanism([(0, 1, 5), (1, 2, 5), (2, 3, 5), (3, 0, 5)], sizes=[6] * 4), id="floating-loop"),
        pytest.param(mechanism([(0, 1, 3), (0, 1, 2), (GROUND, 0, 6)], sizes=[6, 6]), id="two-joints-of-a-pair"),
        pytest.param(mechanism([(0, 1, 2), (0, 2, 2), (GROUND, 2, 2)], sizes=[12, 3, 6]), id="different-sizes"),
    ],
)
@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e6])
def test_constraints_defer_no_pivot(rng: np.random.Generator, pattern: Pattern, mass: float) -> None:
    A = random_matrix(rng, pattern, mass=mass)
    matrix = assert_solves(pattern, A, rng, spare=4)
    assert matrix.counts[sparse.DEFERRED] == 0


def test_sheets_are_dissected(rng: np.random.Generator) -> None:
    """A line of nodes across the sheet is eliminated last; the order is the same each time."""
    pattern = sheet(11)
    near: list[set[int]] = [set() for _ in pattern.blocks]
    for a, b in pattern.pairs.tolist():
        near[a].add(b)
        near[b].add(a)
    groups = dissection.groups(near, [6] * len(near), range(144))
    assert sorted(itertools.chain(*groups)) == list(range(144))
    assert len(groups[-1]) == 12
    ordered = ordering.elimination_order(pattern)
    assert [own.tolist() for own in ordered.blocks] == [
        own.tolist() for own in ordering.elimination_order(pattern).blocks
    ]
    A = random_matrix(rng, pattern)
    matrix = assert_solves(pattern, A, rng, spare=4)
    assert matrix.counts[sparse.DEFERRED] == 0


def test_hinged_panels_that_are_dissected_defer_no_pivot(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hinges wait for both of their panels, on whichever side of a separator these are."""
    monkeypatch.setattr(ordering, "MANY", 0)
    monkeypatch.setattr(ordering, "FEWER", np.inf)
    panel = np.arange(81).reshape(9, 9)
    ends = [np.stack([own[:-1].ravel(), own[1:].ravel()], axis=1) for own in (panel, panel.T)]
    pattern = mechanism([(a, b, 1) for a, b in np.concatenate(ends).tolist()], sizes=[6] * 81)
    matrix = assert_solves(pattern, random_matrix(rng, pattern), rng, spare=4)
    assert matrix.counts[sparse.DEFERRED] == 0
    last = [block.tolist() for block in ordering.elimination_order(pattern).blocks][-9:]
    assert sum(unknowns[0] >= 6 * 81 for unknowns in last) > 3


def test_trees_of_massless_bodies_defer_no_pivot(rng: np.random.Generator) -> None:
    # what statics has: bodies that are held by joints of six constraints only
    pattern = mechanism([(k // 2 - 1 if k > 1 else GROUND, k, 6) for k in range(9)], sizes=[6] * 9)
    A = random_matrix(rng, pattern)
    A[:54, :54] = 0.0
    matrix = assert_solves(pattern, A, rng, spare=4)
    assert matrix.counts[sparse.DEFERRED] == 0


@given(seed=st.integers(0, 10_000), bodies=st.integers(1, 7), extra=st.integers(0, 3))
def test_random_mechanisms(seed: int, bodies: int, extra: int) -> None:
    rng = np.random.default_rng(seed)
    joints = [(int(rng.integers(-1, k)), k, int(rng.integers(1, 6))) for k in range(bodies)]
    joints += [(int(rng.integers(-1, k)), k, 1) for k in rng.integers(0, bodies, extra)]
    pattern = mechanism(joints, sizes=[6] * bodies)
    A = random_matrix(rng, pattern)
    if np.linalg.cond(A) < 1e10:
        matrix = assert_solves(pattern, A, rng, spare=3)
        assert matrix.counts[sparse.DEFERRED] == 0


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_constraints_of_any_scale(rng: np.random.Generator, scale: float) -> None:
    pattern = four_bars(4)
    A = random_matrix(rng, pattern)
    split = int(sum(block.size for block, m in zip(pattern.blocks, pattern.multipliers, strict=True) if not m))
    A[split:, :split] *= scale
    A[:split, split:] *= scale
    x = rng.standard_normal(len(A))
    x[split:] /= scale
    b = A @ x
    matrix = ordering.matrix_of(pattern, spare=5)
    fill(matrix, A)
    assert sparse_lu.factor(matrix) == 0
    assert matrix.counts[sparse.DEFERRED] == 0
    sparse_lu.solve(matrix, b)
    assert_allclose(b[:split], x[:split], rtol=1e-7, atol=1e-7)
    assert_allclose(b[split:], x[split:], rtol=1e-7, atol=1e-7 / scale)


def test_large_system_against_a_sparse_solver(rng: np.random.Generator) -> None:
    pattern = four_bars(60)
    matrix = ordering.matrix_of(pattern)
    fill(matrix, random_matrix(rng, pattern))
    A, x = sparse_of(matrix).tocsc(), rng.standard_normal(matrix.place.size)
    expected = splu(A).solve(x)
    assert sparse_lu.factor(matrix) == 0
    sparse_lu.solve(matrix, x)
    assert_allclose(x, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


# ---------------------------------------------------------------------------------------------- singular systems


@pytest.mark.parametrize("redundant", [1, 2, 3])
@pytest.mark.parametrize("loop", [False, True])
def test_redundant_constraints_are_counted_and_named(rng: np.random.Generator, redundant: int, loop: bool) -> None:
    bodies, last = 4, (3, GROUND, 5 if loop else 1)
    joints = [(k - 1, k, 4) for k in range(bodies)] + [(0, 1, redundant)] + ([last] if loop else [])
    pattern = mechanism(joints, sizes=[6] * bodies)
    A = random_matrix(rng, pattern)
    split, same, other = 6 * bodies, pattern.blocks[bodies + bodies], pattern.blocks[bodies + 1]
    A[same] = rng.standard_normal((redundant, 4)) @ A[other]  # says what the joint of bodies 0 and 1 says
    A[:, same] = A[same].T
    matrix = ordering.matrix_of(pattern, spare=8)
    fill(matrix, A)
    b = A @ np.ones(len(A))
    x = b.copy()
    assert sparse_lu.factor(matrix) == redundant
    sparse_lu.solve(matrix, x)
    assert_allclose(x[:split], np.ones(split), rtol=1e-8, atol=1e-8)
    assert_allclose(A @ x, b, rtol=1e-8, atol=1e-8)
    named = ordering.redundant_unknowns(matrix)
    assert named.size == redundant
    assert set(named) <= {*same, *other}
    assert_allclose(x[named], 0.0, atol=1e-8)


def test_constraint_of_nothing_is_redundant(rng: np.random.Generator) -> None:
    pattern = chain(3)
    A = random_matrix(rng, pattern)
    row = pattern.blocks[4][2]
    A[row] = A[:, row] = 0.0
    matrix = ordering.matrix_of(pattern, spare=2)
    fill(matrix, A)
    assert sparse_lu.factor(matrix) == 1
    assert ordering.redundant_unknowns(matrix).tolist() == [row]


def test_more_redundant_constraints_than_room_are_counted(rng: np.random.Generator) -> None:
    pattern = chain(4)
    A = random_matrix(rng, pattern)
    rows = np.concatenate([pattern.blocks[4][:3], pattern.blocks[6][:2]])
    A[rows] = A[:, rows] = 0.0
    matrix = ordering.matrix_of(pattern, spare=2)
    fill(matrix, A)
    assert sparse_lu.factor(matrix) == 5
    assert set(ordering.redundant_unknowns(matrix)) <= set(rows)


def springs_of(n: int, m: int) -> tuple[Pattern, Array]:
    """Nodes in a row with springs between them that nothing holds: singular, m rigid modes."""
    rng = np.random.default_rng(7)
    pattern = pattern_of([m] * n, [(k, k + 1) for k in range(n - 1)])
    A = np.zeros((n * m, n * m))
    for k in range(n - 1):
        root = rng.standard_normal((m, m))
        both = slice(k * m, (k + 2) * m)
        A[both, both] += np.kron([[1.0, -1.0], [-1.0, 1.0]], root @ root.T + np.eye(m))
    return pattern, A


def held(n: int, m: int, at: int, rows: int) -> tuple[Pattern, Array]:
    """The same with unknowns of one node held by constraints."""
    pattern, A = springs_of(n, m)
    blocks = [*pattern.blocks, np.arange(n * m, n * m + rows)]
    G = np.zeros((rows, n * m))
    G[:, at * m : at * m + rows] = np.eye(rows)
    fixed = np.zeros(n + 1, dtype=bool)
    pattern = Pattern(blocks, np.arange(n + 1) == n, np.vstack([pattern.pairs, [n, at]]), fixed)
    return pattern, np.block([[A, G.T], [G, np.zeros((rows, rows))]])


@pytest.mark.parametrize(("n", "m"), [(2, 3), (12, 6), (5, 12), (60, 6)])
@pytest.mark.parametrize("place", [0.0, 0.5, 1.0])
def test_chains_that_only_constraints_hold(rng: np.random.Generator, n: int, m: int, place: float) -> None:
    pattern, A = held(n, m, round(place * (n - 1)), m)
    matrix = assert_solves(pattern, A, rng, spare=m)
    assert matrix.counts[sparse.DEFERRED] == 0  # the constraints are eliminated with the node that they hold


def test_blocks_that_only_deferred_pivots_hold(rng: np.random.Generator) -> None:
    # a loop of massless bodies: each waits for both of its joints
    pattern = mechanism([(0, 1, 3), (1, 2, 3), (2, 0, 3), (GROUND, 0, 6)], sizes=[6] * 3)
    A = random_matrix(rng, pattern)
    A[:18, :18] = 0.0
    A[6:18, 6:18] = np.diag(rng.uniform(0.0, 1.0, 12) * (np.arange(12) % 2))
    matrix = assert_solves(pattern, A, rng, spare=12)
    assert matrix.counts[sparse.DEFERRED] > 0


@pytest.mark.parametrize("rows", [0, 4])
def test_freedom_that_nothing_holds_is_counted(rows: int) -> None:
    pattern, A = held(9, 6, 3, rows) if rows else springs_of(9, 6)
    matrix = ordering.matrix_of(pattern, spare=6)
    fill(matrix, A)
    assert sparse_lu.factor(matrix) == 6 - rows


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_singular_blocks_are_refused(rng: np.random.Generator, value: float) -> None:
    pattern = pattern_of([6] * 4, [(0, 1), (1, 2), (2, 3)])
    matrix, A = ordering.matrix_of(pattern), random_matrix(rng, pattern)
    A[:, 14] = 0.0
    fill(matrix, A)
    sparse.add_entry(matrix, 14, 14, value)
    with np.errstate(invalid="ignore"):  # NumPy warns of inf - inf where nothing is compiled
        assert sparse_lu.factor(matrix) == sparse.SINGULAR


def test_quality_falls_with_the_condition() -> None:
    matrix = ordering.matrix_of(pattern_of([2], []))
    fill(matrix, np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]]))
    assert sparse_lu.factor(matrix) == 0
    assert_allclose(matrix.quality[0], 1e-9, rtol=1e-6)


# ---------------------------------------------------------------------------------------------- low-rank products


@pytest.mark.parametrize("pattern", [pattern_of([6] * 5, [(0, 1), (1, 2), (2, 3), (3, 4)]), four_bars(2)])
def test_inner_unknowns_stand_for_a_product_outside_the_blocks(rng: np.random.Generator, pattern: Pattern) -> None:
    A = random_matrix(rng, pattern)
    n = len(A)
    matrix = ordering.matrix_of(pattern, spare=2, inner=7)
    for _ in range(2):  # the second time, after a matrix with other inner unknowns
        sparse.clear(matrix)
        fill(matrix, A)
        whole = A.copy()
        for width in (2, 3):
            q = sparse.inner(matrix, width)
            B, C = np.zeros((n, width)), np.zeros((n, width))
            at = rng.choice(n, 8, replace=False)
            B[at], C[at] = rng.standard_normal((2, 8, width))
            for i in at:
                for c in range(width):
                    sparse.add_inner(matrix, i, q + c, B[i, c], C[i, c])
            whole += B @ C.T
        assert_allclose(sparse_of(matrix).toarray(), whole, rtol=0.0, atol=1e-14)
        b = rng.standard_normal(n)
        x = b.copy()
        assert sparse_lu.factor(matrix) == 0
        sparse_lu.solve(matrix, x)
        assert_allclose(whole @ x, b, rtol=1e-8, atol=1e-8)


# ---------------------------------------------------------------------------------------------- assembly and cost


def test_blocks_are_added_as_entries_are(rng: np.random.Generator) -> None:
    pattern = four_bars(3)
    one, other = ordering.matrix_of(pattern), ordering.matrix_of(pattern)
    K = rng.standard_normal((12, 12))
    for a, b in [*pattern.pairs.tolist(), *np.flip(pattern.pairs, axis=1).tolist(), (2, 2)]:
        rows, columns = pattern.blocks[a], pattern.blocks[b]
        sparse.add_block(one, rows[0], columns[0], K, 6, 2, rows.size, columns.size, 1.0)
        for r, i in enumerate(rows):
            for c, j in enumerate(columns):
                sparse.add_entry(other, i, j, K[6 + r, 2 + c])
    assert one.values.any()
    assert_allclose(one.values, other.values, rtol=0.0, atol=0.0)
    assert one.counts[sparse.OUTSIDE] == 0
    sparse.clear(one)
    assert not one.values.any()


def test_entries_outside_the_pattern_are_counted() -> None:
    matrix = ordering.matrix_of(pattern_of([3, 3, 3], [(0, 1), (1, 2)]))
    sparse.add_entry(matrix, 0, 8, 1.0)
    sparse.add_block(matrix, 6, 0, np.ones((3, 3)), 0, 0, 3, 3, 1.0)
    assert matrix.counts[sparse.OUTSIDE] == 2
    assert not matrix.values.any()


@pytest.mark.parametrize(
    "system",
    [chain, star, frame, four_bars, lambda n: springs_of(n, 6)[0], lambda n: springs_of(n, 12)[0]],
    ids=["chain", "star", "frame", "four-bars", "beam", "beam-of-large-nodes"],
)
def test_cost_is_linear_in_the_number_of_bodies(system: object) -> None:
    counts = []
    for n in (10, 20, 40):
        matrix = ordering.matrix_of(system(n))  # type: ignore[operator]
        counts.append((ordering.operations(matrix), matrix.values.size))
    a, b, c = np.array(counts)
    assert_allclose(c - b, 2 * (b - a), rtol=0.02)


def test_chain_has_no_fill() -> None:
    matrix = ordering.matrix_of(springs_of(20, 6)[0])
    assert matrix.values.size == 20 * 36 + 19 * 72
    assert matrix.unknown.tolist() == list(range(120))  # from one end to the other


def dissected(rows: range, columns: range, across: int) -> list[int]:
    """Nodes of a part of a grid in the order of nested dissection by straight lines."""
    if len(rows) * len(columns) <= 4:
        return [i * across + j for i in rows for j in columns]
    if len(rows) < len(columns):
        k = len(columns) // 2
        halves, line = ((rows, columns[:k]), (rows, columns[k + 1 :])), (rows, columns[k : k + 1])
    else:
        k = len(rows) // 2
        halves, line = ((rows[:k], columns), (rows[k + 1 :], columns)), (rows[k : k + 1], columns)
    ends = [node for half in halves for node in dissected(*half, across)]
    return ends + [i * across + j for i in line[0] for j in line[1]]


@pytest.mark.parametrize(("n", "allowed"), [(16, 1.0), (32, 1.01)])
def test_mesh_of_a_surface_costs_no_more_than_by_straight_cuts(n: int, allowed: float) -> None:
    """Four-node elements, six unknowns a node."""
    across, pattern = n + 1, sheet(n)
    near: list[set[int]] = [set() for _ in pattern.blocks]
    for a, b in pattern.pairs.tolist():
        near[a].add(b)
        near[b].add(a)
    wanted = 0
    for node in dissected(range(across), range(across), across):
        around, m = near[node], 6
        w = m * len(around)
        wanted += m * (m - 1) * (2 * m - 1) // 6 + m * m * w + m * w * w
        for other in around:
            near[other] |= around
            near[other] -= {node, other}
    found = ordering.operations(ordering.matrix_of(pattern))
    assert found < allowed * wanted


def test_order_is_the_same_each_time() -> None:
    for pattern in (star(6), four_bars(6), frame(5)):
        one, other = ordering.elimination_order(pattern), ordering.elimination_order(pattern)
        assert [b.tolist() for b in one.blocks] == [b.tolist() for b in other.blocks]


def test_an_order_is_found_once_for_a_pattern(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pattern that comes again has a matrix of its own with the same order; any difference makes another order."""
    found: list[Pattern] = []
    order = ordering.elimination_order
    monkeypatch.setattr(ordering, "elimination_order", lambda pattern: (found.append(pattern), order(pattern))[1])
    monkeypatch.setattr(ordering, "_kept", {})
    first = ordering.matrix_of(pattern_of([3, 2, 4], [(0, 1), (1, 2)]))
    first.values[:] = 7.0
    again = ordering.matrix_of(pattern_of([3, 2, 4], [(0, 1), (1, 2)]))
    assert len(found) == 1
    assert not again.values.any()
    assert_allclose(again.unknown, first.unknown)
    others = [pattern_of([2, 3, 4], [(0, 1), (1, 2)]), pattern_of([3, 2, 4], [(0, 1), (0, 2)])]
    for pattern in others:
        ordering.matrix_of(pattern)
    ordering.matrix_of(others[0], spare=2)
    carried = others[0]._replace(stiff=frozenset({0}))
    assert ordering.matrix_of(carried).unknown.size == first.unknown.size
    assert len(found) == 5
