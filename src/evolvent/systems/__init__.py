"""Systems: what can be run by name. Each is one module or package of this folder, and its built-in cases as YAML.

A module ``inertia_stand`` (a name with ``_`` first is no system) is the system ``inertia-stand``. It is found by its
name alone: `evolvent.cases.system` imports it when a case asks for it, and nothing outside it knows more than this:

``Case``
    The pydantic model (an `evolvent.cases.Section`) of its cases. Its key ``system`` holds the system's name.
``plan(case, *, laws=None) -> evolvent.cases.Plan``
    The case, checked and prepared; its function ``run`` returns the run as a Dataset, labelled by
    `evolvent.results.label`. Refuses, with an `InputError`, whatever can be found before the run; it is called before a
    compilation is announced, so it must not start a long one. `laws` may hold laws of the user's, by name.
``layout(case) -> {variable: {dimension: size or None}}``
    The numeric variables that ``numbers``, ``figures`` and ``motion`` read; a file without them is refused. None is any
    size from 1.
``numbers(run) -> [evolvent.figures.Number]``
    The table on the screen.
``figures(run) -> [evolvent.figures.Figure]``
    What to draw; may be empty.
``motion(run) -> evolvent.motion.Motion or None``
    Lines, bodies, forces and marks at every sample, from which animations and files for other programs are drawn.

A system that can be stepped from outside (`evolvent.Stepper.of_case`) has two more:

``build(case) -> evolvent.System``
    Its parts; bodies have names that do not change.
``stepping(case) -> {argument of evolvent.Stepper: value}``
    Method, step, tolerance and spectral radius that the case asks for.

In a folder, ``case`` holds what a user writes, ``structure`` the parts of its system, ``simulate`` the runs,
``dataset`` the variables of a run, ``show`` its numbers and figures and ``places`` its motion.

A built-in case is a YAML file in this folder or in the system's own; its first line is a comment that says what it is.
Its name is the file's, with ``-`` for ``_``. Files with a second suffix, such as ``map.study.yaml``, are no cases.
"""
