r"""An independent checker of certificate files: it shares no code with the engine or with what wrote them.

It reads the statements of a file and decides each of them anew from the equation of motion

    x'' + 2 zeta x' + x = cos(Omega t) + h cos(3 Omega t) - s S     while s = sgn x' is not 0,
    x' = 0                                                          while |u| <= S0,  u = x - f(t),

by other means than the prover: the textbook solution with its amplitudes divided by the distance to
resonance (so that it asks for more digits near it), the stops as unknowns (their times and displacements,
the velocity is 0 there), the multipliers by Jury's inequalities for trace and determinant. Its only tool
is ball arithmetic (Arb).

    solution   x = -s S + sum_k F_k [(1 - w^2) cos w t + 2 zeta w sin w t] / [(1 - w^2)^2 + (2 zeta w)^2]
                   + alpha C(tau) + beta D(tau),      w = Omega, 3 Omega,   F = 1, h,
               C, D the solutions of c'' + 2 zeta c' + c = 0 that start with (1, 0) and (0, 1);
    by start   dx/dx_0 = C,  dx/dt_0 = -a_0 D  (a_0 the first acceleration, the end of the slide held fixed).

A joint is where a slide or a stick begins, at (t_i, x_i). Statements of a file:

    exists       a solution of the stated segments lies in the box around the printed joints unique
    there is no second one in it admissible   slides keep their direction and stop only at their ends,
    sticks bear less than S0 up to theirs,
                 and what follows each stop and release is what the law of friction says
    stable       both multipliers of a turn lie inside of the unit circle; "refuted": one lies outside
    multipliers  each lies in its stated disc
    enclosure    each joint of the solution lies in its stated ball
"""
