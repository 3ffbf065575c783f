r"""An independent checker of certificate files: it shares no code with the engine or with what wrote them.

It reads the statements of a file and decides each of them anew from the equation of motion

    x'' + 2 zeta x' + x = cos(Omega t) + h cos(3 Omega t) - s S     while s = sgn x' is not 0,
    x' = 0                                                          while |u| <= S0,  u = x - f(t),

by other means than the prover: the textbook solution (without damping in products, which hold at resonance),
the stops as unknowns (their times and displacements), the multipliers by Jury's inequalities for trace and
determinant. Its only tool is ball arithmetic (Arb).

    solution   x = -s S + (x_0 + s S) C(tau) + sum_k F_k r_k(t, tau),  w = Omega, 3 Omega,  F = 1, h;
               C, D solve c'' + 2 zeta c' + c = 0 from (1, 0), (0, 1); r the response to cos w t from rest
    by start   dx/dx_0 = C,  dx/dt_0 = -a_0 D  (a_0 the first acceleration, the end of the slide fixed).

A joint is where a slide or a stick begins. What a file may state:

    exists, unique   one solution of the segments lies in the box around the printed joints, and one only
    admissible       slides keep their direction to their ends, sticks bear less than S0 up to theirs, and
                     what follows each stop and release is what the law of friction says
    stable           both multipliers of a turn lie inside of the unit circle; "refuted": one outside
    multipliers, enclosure   each multiplier, each joint of the solution lies in its stated ball
"""
