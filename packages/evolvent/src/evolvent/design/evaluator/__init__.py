"""The evaluator: kept values of runs at keys that change, under studies, dispersions, designs and calibrations.

An `Evaluator` is given runs (`task.Runs`) and points: keys of a case and their values. It evaluates each point once, in
this process, in threads, in processes or on the workers of a Dask scheduler, keeps what comes back in memory and in a
log, and goes on from that log after any end of the process. The bits do not depend on where a point is evaluated, nor
on how points are batched.
"""
