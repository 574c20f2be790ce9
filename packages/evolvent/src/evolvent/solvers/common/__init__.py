"""What solvers share: energy balances, solutions, the matrix graph, laws, limits."""
