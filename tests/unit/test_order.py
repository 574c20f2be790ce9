"""The order of rows of constraints."""

import itertools

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee as of_scipy

from evolvent.assembly.order import reverse_cuthill_mckee


@pytest.mark.parametrize("n", [1, 2, 7, 16, 60, 300])
def test_order_is_that_of_scipy(rng, n):
    for share in (0.5, 1.0, 3.0):
        one = rng.integers(0, n, size=(int(share * n) + 1, 2))
        pairs = np.concatenate([one, one[:, ::-1], one[:3]])
        graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n, n)).tocsr()
        graph.setdiag(0.0)
        graph.eliminate_zeros()
        own = [(int(a), int(b)) for a, b in pairs if a != b]
        order = reverse_cuthill_mckee(own, n)
        if own:
            np.testing.assert_array_equal(order, of_scipy(graph, symmetric_mode=True))
        assert sorted(order) == list(range(n))


def test_a_chain_in_any_order_has_a_bandwidth_of_one(rng):
    names = rng.permutation(40)
    pairs = [(int(a), int(b)) for a, b in itertools.pairwise(names)]
    place = np.argsort(reverse_cuthill_mckee([*pairs, *((b, a) for a, b in pairs)], 40))
    assert max(abs(place[a] - place[b]) for a, b in pairs) == 1


def test_nodes_without_neighbours_stay_in_order():
    np.testing.assert_array_equal(reverse_cuthill_mckee([], 4), np.arange(4))
