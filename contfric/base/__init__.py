"""Tools that every package may use: files, YAML, tables, lazy names, interrupts, memory.

What to find where:

* files and folders: ``files``, ``checked``, ``resources``, ``sources``, ``yaml_lines``, ``yaml_schema``;
* names and results: ``lazy``, ``named``, ``renamed``, ``attributes``, ``shown``, ``tabled``, ``arrays``;
* the machine: ``interrupts``, ``pace``, ``memory``, ``one_thread``, ``tally``, ``extras``.
"""
