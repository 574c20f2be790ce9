"""Systems: what can be run by name. Each is one module or package of this folder, and its built-in cases as YAML.

A module ``inertia_stand`` (a name with ``_`` first is no system) is the system ``inertia-stand``; its ``SYSTEM`` is an
`evolvent.analysis.definition.SystemDefinition`, which says what a system provides. `evolvent.cases.system` imports it
when a case asks for it, and nothing outside knows more than the definition. Packages outside add systems by entry
points.

In a folder, ``case`` holds what a user writes, ``structure`` the parts of its system, ``settings`` or ``simulate``
how it
is run, ``derived`` the variables of its field at the root of the results, ``show`` what is shown of it.

A built-in case is a YAML file in this folder or in the system's own (of the system `structure` in ``structures/``); its
first line is a comment that says what it is. Its name is the file's, with ``-`` for ``_``. Files with a second suffix,
such as ``map.study.yaml``, are no cases.
"""
