r"""An independent checker of certificate files: it shares no code with the engine or with what wrote them.

It decides each statement of a file anew, in ball arithmetic (Arb), from the equation of motion

    x'' + 2 zeta x' + x = cos(Omega t) + h cos(3 Omega t) - s S     while s = sgn x' is not 0,
    x' = 0                                                          while |u| <= S0,  u = x - f(t):

the textbook solution ``x = -s S + (x_0 + s S) C(tau) + sum_k F_k r_k(t, tau)``, c'' + 2 zeta c' + c = 0 for C
from (1, 0) and D from (0, 1), r from rest; ``dx/dx_0 = C, dx/dt_0 = -a_0 D``, a_0 the first acceleration.
Unknowns are where slides and sticks begin; the multipliers are judged by Jury's inequalities.
"""
