"""Systems: each a Case, build(case) -> System, run(case) -> Run, its numbers, figures and scene."""
