"""What one would write today, with packages from PyPI, for the questions that contfric answers.

The oscillator is ``x'' + x = cos(Omega t) - S sgn(x')``, held at rest while ``|x - cos(Omega t)| <= S0``.
The orbit is 1a: released at the lower limit at t0, up to the stop at t1, down to the stop at t2, held
until t0 + T. Every peer types this order of segments by hand, takes the stick in closed form, and has
analytic derivatives where its solver accepts them. Nothing of contfric is used here.

``oscillator`` has what all share; ``dop853``, ``heyoka_taylor``, ``cvode`` and ``diffrax_dopri8`` integrate
one slide to its stop; ``shooting``, ``arclength`` and ``simulation`` answer the questions with any of those;
``collocation``, ``collocation_fold`` and ``collocation_branch`` do so with ``solve_bvp``; ``interpreted`` has
the slides in closed form.
"""
