"""Sparse matrices of dense blocks, factored along a given elimination order by `evolvent.algebra.sparse_lu`.

The unknowns form blocks of any size; `evolvent.algebra.ordering` finds the order in which blocks are eliminated and
where their entries are stored. Block b keeps its diagonal part D (m, m), its rows U (m, w) in the columns of the later
blocks that it couples to (fill included) and its columns, transposed, Lt (m, w), in the rows of the same blocks.

Inner unknowns z stand for a low-rank product outside the blocks: A x + B z = f with C^T x - z = 0 is
(A + B C^T) x = f, and the solution leaves them out.
"""

import numpy as np
from numba import types, void

from evolvent.compiled.jit import ADDRESSES, MATRIX, REAL, indirect, inlined
from evolvent.compiled.pointer import Struct, array, shared

#: What `factor` returns where the matrix is singular beyond repair, or not finite.
SINGULAR = -1
#: A pivot below this part of its column's size is round-off: its unknown goes to the corner.
TINY_PIVOT = 1e-12
#: A pivot of the corner below this part of the largest one, after scaling, stands for a redundant row.
TINY_CORNER = 1e-10
# columns of SparseBlocks.table: unknowns of the block, of the later blocks it couples to, its first position; index of
# D in the values; its first entry in `later` and their number; its first entry in `target`; multipliers at its end
SIZE, WIDTH, START, AT, FIRST, COUNT, TARGET, MULTIPLIERS, N_TABLE = range(9)
# columns of SparseBlocks.later: the block, and its first column in U and Lt
BLOCK, COLUMN = range(2)
# indices in SparseBlocks.counts: inner unknowns, deferred pivots, rank of the corner, vanishing pivots for which there
# was no room, entries added outside the pattern
INNER, DEFERRED, RANK, LOST, OUTSIDE, N_COUNTS = range(6)


class SparseBlocks(Struct):
    """The matrix before, and its factors after `factor`.

    Attributes
    ----------
    values : (nz,) float, D, U and Lt of each block, row by row
    table : (nb, N_TABLE) int, blocks in the order of their elimination
    later : (ns, 2) int, later blocks that each block couples to, in ascending order
    target : (np,) int, where the product of rows of later block p with columns of later block q >= p is subtracted, for
        all pairs of all blocks: index in the values of the diagonal part of p, or of the columns of q in U of p
    place, unknown : (n,) int, position of each unknown in the order of elimination, and its inverse
    block : (n,) int, block of each position
    pivots : (n,) int, row of the block interchanged with each row
    size, terms : (n,) float, size of each column; sum of the absolute products in a multiplier's diagonal entry
    x, loose : (n,) and (largest block,) float, scratch
    B, C : (n, inner + spare) float, columns and transposed rows beside the blocks, by position
    E : (inner + spare, inner + spare) float, corner
    order : (2, inner + spare) int, rows and columns of the corner in the order of its pivots
    scale, work : (2, inner + spare) float, factors of the corner's rows and columns; scratch
    deferred : (spare,) int, unknowns whose pivots were deferred to the corner
    counts : (N_COUNTS,) int
    quality : (1,) float, smallest pivot beside the size of its column
    addresses : of functions that compiled code calls by address
    """

    values: np.ndarray = array(1)
    table: np.ndarray = array(2, np.int64)
    later: np.ndarray = array(2, np.int64)
    target: np.ndarray = array(1, np.int64)
    place: np.ndarray = array(1, np.int64)
    unknown: np.ndarray = array(1, np.int64)
    block: np.ndarray = array(1, np.int64)
    pivots: np.ndarray = array(1, np.int64)
    size: np.ndarray = array(1)
    terms: np.ndarray = array(1)
    x: np.ndarray = array(1)
    loose: np.ndarray = array(1)
    B: np.ndarray = array(2)
    C: np.ndarray = array(2)
    E: np.ndarray = array(2)
    order: np.ndarray = array(2, np.int64)
    scale: np.ndarray = array(2)
    work: np.ndarray = array(2)
    deferred: np.ndarray = array(1, np.int64)
    counts: np.ndarray = array(1, np.int64)
    quality: np.ndarray = array(1)
    addresses: np.ndarray = shared(ADDRESSES)


#: The type of a matrix in signatures of compiled functions.
SPARSE = SparseBlocks._numba_type_
_I = types.int64


# ---------------------------------------------------------------------------------------------- assembly


@indirect(void(SPARSE))
def clear(matrix):
    """Set all entries to zero and drop the inner unknowns."""
    values, B, C, counts = matrix.values, matrix.B, matrix.C, matrix.counts
    for i in range(values.size):
        values[i] = 0.0
    used = counts[INNER] + counts[DEFERRED]
    for r in range(B.shape[0] if used > 0 else 0):
        for q in range(used):
            B[r, q] = 0.0
            C[r, q] = 0.0
    counts[INNER] = 0
    counts[OUTSIDE] = 0


@inlined
def _find(matrix, b, c):
    """Entry in `later` of the pair of block b and a later block c; -1 where they do not couple."""
    later = matrix.later
    low, high = matrix.table[b, FIRST], matrix.table[b, FIRST] + matrix.table[b, COUNT]
    while low < high:
        middle = (low + high) // 2
        if later[middle, BLOCK] < c:
            low = middle + 1
        else:
            high = middle
    if low < matrix.table[b, FIRST] + matrix.table[b, COUNT] and later[low, BLOCK] == c:
        return low
    return -1


@inlined
def _first_entry(matrix, i, j):
    """`first_entry`."""
    table, p, q = matrix.table, matrix.place[i], matrix.place[j]
    b, c = matrix.block[p], matrix.block[q]
    r, s = p - table[b, START], q - table[c, START]
    if b == c:
        return table[b, AT] + r * table[b, SIZE] + s, 1, table[b, SIZE]
    if b < c:
        k = _find(matrix, b, c)
        if k < 0:
            matrix.counts[OUTSIDE] += 1
            return -1, 0, 0
        m, w = table[b, SIZE], table[b, WIDTH]
        return table[b, AT] + m * m + r * w + matrix.later[k, COLUMN] + s, 1, w
    k = _find(matrix, c, b)
    if k < 0:
        matrix.counts[OUTSIDE] += 1
        return -1, 0, 0
    m, w = table[c, SIZE], table[c, WIDTH]
    return table[c, AT] + m * m + m * w + s * w + matrix.later[k, COLUMN] + r, w, 1


@indirect(types.UniTuple(_I, 3)(SPARSE, _I, _I))
def first_entry(matrix, i, j):
    """Index in the values of the entry of unknowns i and j, and from it to the entries of i, j + 1 and of i + 1, j.

    Returns (-1, 0, 0) outside the pattern, which is counted.
    """
    return _first_entry(matrix, i, j)


@indirect(void(SPARSE, _I, _I, REAL))
def add_entry(matrix, i, j, value):
    """Add to the entry of unknowns i and j; what lies outside the pattern is left out and counted."""
    at, _, _ = _first_entry(matrix, i, j)
    if at >= 0:
        matrix.values[at] += value


@indirect(void(SPARSE, _I, _I, MATRIX, _I, _I, _I, _I, REAL))
def add_block(matrix, i, j, K, row, column, rows, columns, scale):
    """Add scale K[row : row + rows, column : column + columns] to unknowns from i and j on, each of one block."""
    at, right, down = _first_entry(matrix, i, j)
    if at < 0:
        return
    if right == 1 and columns == 6:
        for r in range(rows):
            _add_six(matrix.values, at + r * down, K, row + r, column, 0, 1, scale)
    elif down == 1 and rows == 6:
        for c in range(columns):
            _add_six(matrix.values, at + c * right, K, row, column + c, 1, 0, scale)
    else:
        for r in range(rows):
            for c in range(columns):
                matrix.values[at + r * down + c * right] += scale * K[row + r, column + c]


@inlined
def _add_six(values, at, K, r, c, down, right, scale):
    """Add six entries of K, from (r, c) in steps of (down, right), to consecutive values; all are read before."""
    x0, x1, x2 = K[r, c], K[r + down, c + right], K[r + 2 * down, c + 2 * right]
    x3, x4, x5 = (
        K[r + 3 * down, c + 3 * right],
        K[r + 4 * down, c + 4 * right],
        K[r + 5 * down, c + 5 * right],
    )
    x0, x1, x2 = values[at] + scale * x0, values[at + 1] + scale * x1, values[at + 2] + scale * x2
    x3, x4, x5 = values[at + 3] + scale * x3, values[at + 4] + scale * x4, values[at + 5] + scale * x5
    values[at], values[at + 1], values[at + 2] = x0, x1, x2
    values[at + 3], values[at + 4], values[at + 5] = x3, x4, x5


@inlined
def diagonal(matrix, i):
    """Diagonal entry of unknown i."""
    table, p = matrix.table, matrix.place[i]
    b = matrix.block[p]
    return matrix.values[table[b, AT] + (p - table[b, START]) * (table[b, SIZE] + 1)]


@inlined
def inner(matrix, count):
    """The first of `count` new inner unknowns, to be filled by `add_inner`."""
    q = matrix.counts[INNER]
    matrix.counts[INNER] += count
    for p in range(q, q + count):
        for s in range(p + 1):
            matrix.E[p, s] = 0.0
            matrix.E[s, p] = 0.0
        matrix.E[p, p] = -1.0
    return q


@inlined
def add_inner(matrix, i, q, right, left):
    """Add `right` to B and `left` to C, in unknown i and inner unknown q."""
    p = matrix.place[i]
    matrix.B[p, q] += right
    matrix.C[p, q] += left
