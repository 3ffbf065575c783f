"""Responses by simulation: sweeps of a parameter, return maps, basins of attraction, stable sets.

``docs/response.md`` has examples, what the numbers mean, and how to spread basins over machines.

What to find where:

* points on a section: ``sections`` (names), ``section`` and ``cutting`` (compiled), ``cuts``, ``collecting``;
* one solution: ``poincare``, with the result in ``returns``; along a parameter: ``sweeping``, ``sweep``;
* basins: ``basin_map``, ``basin_tile``, ``basins``; their orbits ``attractors``, ``targets``, ``capture``;
* where basins meet: ``stable_set``, ``stable_half``, ``section_map``;
* releases from rest: ``release``, ``ways_out_of_rest``; how following a solution ended: ``outcome``.
"""
